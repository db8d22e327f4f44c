"""Firefox and WebKit for tests, without a window: each by the WebDriver commands that it takes itself.

Firefox listens for them on a socket (``--marionette``), WebKit has a driver of its own that speaks HTTP
(the Debian packages ``firefox-esr``, ``webkit2gtk-driver`` and ``xvfb``). Nothing but Python is needed.
"""

import base64
import json
import os
import shutil
import socket
import subprocess
import time
import urllib.error
import urllib.request
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

START_S, WAIT_S = 90, 90
"""The machine may be busy with other things."""


class Browser:
    """What both have in common; ``command`` is theirs: the name and the way of a command, and what it takes."""

    def command(self, name, way, body=None):
        raise NotImplementedError

    def open(self, address):
        """The page at an address, when it is ready; from then on its errors are kept."""
        self.command("Navigate", "POST url", {"url": address})
        self.until("document.body.dataset.ready || !document.querySelector('#broken').hidden")
        self.js(
            "const keep = (event) => { document.body.dataset.wrong = event.message || event.reason; };"
            "addEventListener('error', keep); addEventListener('unhandledrejection', keep);"
        )

    def js(self, text):
        return self.command("ExecuteScript", "POST execute/sync", {"script": text, "args": []})

    def until(self, true):
        """Wait until something is true."""
        end = time.monotonic() + WAIT_S
        while not self.js(f"return !!({true})"):
            assert time.monotonic() < end, true
            time.sleep(0.05)

    def figure(self, name, pane=0):
        """What a figure says when all has been drawn."""
        # Figures are told every 100 ms of the clock that a frame is given, which must not seem to stand still.
        self.js("player.told_at = -Infinity; player.paint(performance.now());")
        return self.js(f"return document.querySelectorAll('[data-figure={name}]')[{pane}].textContent")

    def act(self, kind, *actions, **more):
        """Keys or a mouse, as the operating system would send them."""
        source = {"type": kind, "id": kind, "actions": list(actions), **more}
        self.command("PerformActions", "POST actions", {"actions": [source]})

    def press(self, key):
        self.act("key", {"type": "keyDown", "value": key}, {"type": "keyUp", "value": key})

    def click(self, x, y):
        down, up = ({"type": f"pointer{which}", "button": 0} for which in ("Down", "Up"))
        move = {"type": "pointerMove", "x": round(x), "y": round(y), "duration": 0}
        self.act("pointer", move, down, up, parameters={"pointerType": "mouse"})

    def picture(self):
        """What is seen, as a PNG."""
        return base64.b64decode(self.command("TakeScreenshot", "GET screenshot", {"full": False}))


class Firefox(Browser):
    def __init__(self, port):
        self.socket = _answered(lambda: socket.create_connection(("127.0.0.1", port)))
        self.socket.settimeout(WAIT_S)
        self.stream = self.socket.makefile("rb")
        self.count = 0
        self._receive()
        self.command("NewSession", "", {})

    def _receive(self):
        size = b""
        while (digit := self.stream.read(1)) != b":":
            assert digit, "Firefox has gone"
            size += digit
        return json.loads(self.stream.read(int(size)))

    def command(self, name, way, body=None):
        self.count += 1
        said = json.dumps([0, self.count, f"WebDriver:{name}", body or {}]).encode()
        self.socket.sendall(b"%d:%s" % (len(said), said))
        _, _, error, answer = self._receive()
        assert error is None, error
        return answer.get("value") if isinstance(answer, dict) else answer


class WebKit(Browser):
    def __init__(self, port, program):
        self.base = f"http://127.0.0.1:{port}"
        _answered(lambda: self.command("", "GET status"))
        options = {"binary": program, "args": ["--automation"]}
        asked = {"capabilities": {"alwaysMatch": {"webkitgtk:browserOptions": options}}}
        self.base += f"/session/{self.command('', 'POST session', asked)['sessionId']}"

    def command(self, name, way, body=None):
        method, _, path = way.partition(" ")
        data = None if method == "GET" else json.dumps(body or {}).encode()
        asked = urllib.request.Request(f"{self.base}/{path}".rstrip("/"), data=data, method=method)
        asked.add_header("Content-Type", "application/json")
        try:
            return json.load(urllib.request.urlopen(asked, timeout=WAIT_S))["value"]
        except urllib.error.HTTPError as error:
            raise AssertionError(error.read().decode()) from error


@contextmanager
def firefox(folder):
    """Firefox, with its profile in a folder."""
    path = next((found for name in ("firefox-esr", "firefox") if (found := shutil.which(name))), None)
    if path is None:
        pytest.skip("there is no Firefox here")
    port = _free_port()
    Path(folder, "user.js").write_text(
        f'user_pref("marionette.port", {port});\nuser_pref("browser.shell.checkDefaultBrowser", false);\n'
    )
    words = [path, "--headless", "--marionette", "--no-remote", "--profile", str(folder)]
    with _running(words, {"HOME": str(folder)}):
        yield Firefox(port)


@contextmanager
def webkit(folder):
    """The small browser that comes with WebKitGTK, on a screen in memory."""
    program = next((str(path) for path in Path("/usr/lib").glob("*/webkit2gtk-4.*/MiniBrowser")), None)
    if program is None or not (shutil.which("WebKitWebDriver") and shutil.which("Xvfb")):
        pytest.skip("there is no WebKitGTK with its driver and Xvfb here")
    read, write = os.pipe()
    screen = ["Xvfb", "-displayfd", str(write), "-screen", "0", "1280x900x24", "-nolisten", "tcp"]
    with _running(screen, {}, pass_fds=(write,)):
        os.close(write)
        with os.fdopen(read) as said:
            display = f":{said.readline().strip()}"
        port = _free_port()
        with _running(["WebKitWebDriver", f"--port={port}"], {"DISPLAY": display, "HOME": str(folder)}):
            opened = WebKit(port, program)
            try:
                yield opened
            finally:
                with suppress(AssertionError, OSError):
                    opened.command("", "DELETE ")


@contextmanager
def _running(words, more, **options):
    quiet = subprocess.DEVNULL
    process = subprocess.Popen(words, env={**os.environ, **more}, stdout=quiet, stderr=quiet, **options)
    try:
        yield
    finally:
        process.terminate()
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _free_port():
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


def _answered(call):
    """What a call gives as soon as somebody answers it."""
    end = time.monotonic() + START_S
    while True:
        try:
            return call()
        except OSError:
            assert time.monotonic() < end, "the browser does not answer"
            time.sleep(0.1)

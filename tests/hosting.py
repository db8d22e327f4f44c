"""Print hosts for tests: the real ones in processes of their own, and small ones that refuse what those refuse."""

import hashlib
import http.client
import json
import re
import socket
import socketserver
import subprocess
import threading
import time
import urllib.request
import zlib
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from types import SimpleNamespace
from urllib.parse import parse_qs, unquote, urlsplit

import pytest

KEY = "0123456789abcdef0123456789abcdef"
AS_USER = {"X-Api-Key": KEY}
UP_S = 60


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@contextmanager
def _running(command, url, log, folder, headers):
    """A server in a process of its own, until the block ends; stopped by its process id."""
    with log.open("w") as out:
        process = subprocess.Popen(command, stdout=out, stderr=out, cwd=folder, start_new_session=True)
        try:
            end = time.monotonic() + UP_S
            while True:
                try:
                    urllib.request.urlopen(urllib.request.Request(url, headers=headers), timeout=2).read()
                    break
                except (OSError, http.client.HTTPException):
                    if process.poll() is not None or time.monotonic() > end:
                        pytest.skip(f"{command[0]} does not come up: {log.read_text()[-300:]}")
                    time.sleep(0.2)
            yield process
        finally:
            process.terminate()
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


@contextmanager
def octoprint(python, folder):
    """OctoPrint on the loopback address, with its virtual printer: its address."""
    port, base = free_port(), folder / "octoprint"
    base.mkdir()
    (base / "config.yaml").write_text(
        f"accessControl: {{salt: {KEY}}}\napi: {{key: {KEY}}}\n"
        "server: {firstRun: false, onlineCheck: {enabled: false}, pluginBlacklist: {enabled: false}}\n"
        "plugins: {announcements: {_disabled: true}, softwareupdate: {_disabled: true}, "
        "virtual_printer: {enabled: true}}\n"
    )
    command = [
        python,
        "-m",
        "octoprint",
        "serve",
        "--basedir",
        str(base),
        "--host",
        "127.0.0.1",
        "--port",
        str(port),
    ]
    url = f"http://127.0.0.1:{port}"
    with _running(
        [*command, "--iknowwhatimdoing"], f"{url}/api/version", folder / "octoprint.log", folder, AS_USER
    ):
        yield url


@contextmanager
def moonraker(python, folder, trusted=True):
    """Moonraker on the loopback address, without Klipper: its address."""
    port, base = free_port(), folder / "moonraker"
    (base / "config").mkdir(parents=True)
    trust = "trusted_clients:\n    127.0.0.0/8\n" if trusted else "force_logins: False\n"
    (base / "config" / "moonraker.conf").write_text(
        f"[server]\nhost: 127.0.0.1\nport: {port}\nklippy_uds_address: {base}/klippy.sock\n"
        f"[authorization]\n{trust}[file_manager]\n"
    )
    url = f"http://127.0.0.1:{port}"
    up = f"{url}/server/info" if trusted else f"{url}/access/info"
    with _running([python, "-m", "moonraker", "-d", str(base)], up, folder / "moonraker.log", folder, {}):
        yield url


@contextmanager
def klippy(socket_file):
    """A Klipper that is ready, as far as Moonraker asks: the commands that it is told to run, and its state."""
    said = SimpleNamespace(scripts=[], state="standby")

    def answer(method, params):
        if method == "info":
            where = {"klipper_path": "/none", "python_path": "/none", "software_version": "test"}
            return {"state": "ready", "state_message": "Printer is ready", **where}
        if method == "objects/list":
            return {
                "objects": ["webhooks", "print_stats", "virtual_sdcard", "display_status", "pause_resume"]
            }
        if method == "list_endpoints":
            return {
                "endpoints": ["info", "objects/list", "objects/query", "objects/subscribe", "gcode/script"]
            }
        if method in ("objects/query", "objects/subscribe"):
            known = {"print_stats": {"state": said.state}}
            return {"eventtime": 1.0, "status": {name: known.get(name, {}) for name in params["objects"]}}
        if method == "gcode/script":
            said.scripts.append(params["script"])
            said.state = "printing" if params["script"].startswith("SDCARD_PRINT_FILE") else said.state
        return {}

    class Handler(socketserver.StreamRequestHandler):
        def handle(self):
            waiting = b""
            while data := self.request.recv(65536):
                *whole, waiting = (waiting + data).split(b"\x03")  # its mark between messages
                for message in map(json.loads, whole):
                    result = answer(message["method"], message.get("params", {}))
                    self.request.sendall(
                        json.dumps({"id": message.get("id"), "result": result}).encode() + b"\x03"
                    )

    with socketserver.ThreadingUnixStreamServer(str(socket_file), Handler) as server:
        server.daemon_threads = True
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        try:
            yield said
        finally:
            server.shutdown()
            thread.join()


def get(url, path, method="GET", body=None, headers=AS_USER):
    """A request beside the client that is tested."""
    data = None if body is None else json.dumps(body).encode()
    headers = headers | ({"Content-Type": "application/json"} if data else {})
    with urllib.request.urlopen(
        urllib.request.Request(url + path, data, headers, method=method), timeout=20
    ) as a:
        text = a.read()
    return json.loads(text) if text else None


class Refusing:
    """A small host after the published API of ``kind``, that can be told to refuse."""

    def __init__(self, kind, **how):
        self.kind, self.how = kind, how
        self.files, self.seen, self.started = {}, [], []
        self.nonce, self.asked = "1", 0


@contextmanager
def small_host(kind, context=None, **how):
    """(address, host) of a server on the loopback address; ``context`` for TLS."""
    host = Refusing(kind, **how)

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def log_message(self, *_):
            pass

        def answer(self, status, content=None, **headers):
            text = b"" if content is None else json.dumps(content).encode()
            self.send_response(status)
            for name, value in headers.items():
                self.send_header(name, value)
            self.send_header("Content-Length", str(len(text)))
            self.end_headers()
            self.wfile.write(text)

        def body(self):
            return self.rfile.read(int(self.headers.get("Content-Length", 0)))

        def handle_any(self):
            data = self.body()
            host.seen.append((self.command, self.path, dict(self.headers), data))
            ANSWERS[host.kind](self, host, urlsplit(self.path), data)

        do_GET = do_POST = do_PUT = handle_any  # noqa: N815 - so does the library call them

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    if context is not None:
        server.socket = context.wrap_socket(server.socket, server_side=True)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield f"http{'s' if context else ''}://127.0.0.1:{server.server_port}", host
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


def _stored(host, name, data):
    host.files[name] = data[:-1] if host.how.get("loses") else data


def _knows_digest(handler, host):
    """RFC 7616 with MD5, as PrusaLink asks for it; a nonce holds for ``nonce_for`` requests."""
    said = dict(re.findall(r'(\w+)="?([^",]+)"?', handler.headers.get("Authorization", "")))
    host.asked += said.get("nonce") == host.nonce
    if host.asked > host.how.get("nonce_for", 1000):
        host.nonce, host.asked = host.nonce + "1", 0
    if said.get("nonce") != host.nonce or said.get("username") != host.how["user"]:
        return False

    def md5(*parts):
        return hashlib.md5(":".join(parts).encode()).hexdigest()

    mine = md5(said["username"], "Printer API", KEY)
    asked = md5(handler.command, said["uri"])
    return said["response"] == md5(mine, host.nonce, said["nc"], said["cnonce"], said["qop"], asked)


def prusalink(handler, host, url, data):
    """As PrusaLink's openapi.yaml says: a key, a storage, PUT with its length, 409 for what is printed."""
    if not (_knows_digest(handler, host) if "user" in host.how else handler.headers.get("X-Api-Key") == KEY):
        asks = f'Digest realm="Printer API", nonce="{host.nonce}", qop="auth"'
        return handler.answer(401, {"title": "Unauthorized"}, **{"WWW-Authenticate": asks})
    if url.path == "/api/version":
        return handler.answer(200, {"api": "2.0.0", "text": "PrusaLink 0.7"})
    if url.path == "/api/v1/storage":
        usb = {"path": "/usb/", "read_only": False, "available": not host.how.get("no_drive")}
        return handler.answer(200, {"storage_list": [usb]})
    if url.path == "/api/v1/status":
        return handler.answer(200, {"printer": {"state": "PRINTING" if host.how.get("printing") else "IDLE"}})
    name = unquote(url.path).removeprefix("/api/v1/files/usb/")
    if handler.command == "PUT":
        if "Content-Length" not in handler.headers or handler.headers["Print-After-Upload"] not in (
            "?0",
            "?1",
        ):
            return handler.answer(400)
        if host.how.get("full"):
            return handler.answer(507, {"title": "Insufficient Storage"})
        if name in host.files and handler.headers.get("Overwrite") != "?1":
            return handler.answer(409)
        _stored(host, name, data)
        return handler.answer(201)
    if handler.command == "GET":
        known = name in host.files
        return handler.answer(200 if known else 404, {"size": len(host.files[name])} if known else None)
    host.started.append(name)
    return handler.answer(204)


def duet(handler, host, url, data):
    """As RepRapFirmware answers: err 1 for a wrong password or a failed upload, a session key, a CRC."""
    asked = {key: value[0] for key, value in parse_qs(url.query).items()}
    if url.path == "/rr_connect":
        right = asked["password"] == KEY
        return handler.answer(
            200, {"err": 0, "sessionKey": 77, "boardType": "duet3mini"} if right else {"err": 1}
        )
    if handler.headers.get("X-Session-Key") != "77":
        return handler.answer(401)
    if url.path == "/rr_model":
        return handler.answer(
            200, {"key": "state.status", "result": "processing" if host.how.get("printing") else "idle"}
        )
    if url.path == "/rr_upload":
        right = not host.how.get("full") and int(asked["crc32"], 16) == zlib.crc32(data)
        if right:
            _stored(host, asked["name"], data)
        return handler.answer(200, {"err": 0 if right else 1})
    if url.path == "/rr_fileinfo":
        known = asked["name"] in host.files
        return handler.answer(
            200, {"err": 0, "size": len(host.files[asked["name"]])} if known else {"err": 1}
        )
    if url.path == "/rr_gcode":
        host.started.append(re.fullmatch(r'M32 "0:/gcodes/(.*)"', asked["gcode"])[1])
        return handler.answer(200, {"buff": 250})
    return handler.answer(200, {"err": 0})


def duet_with_computer(handler, host, url, data):
    """As DuetWebServer answers in front of a board."""
    path = unquote(url.path)
    if path.startswith("/rr_"):
        return handler.answer(404)
    if path == "/machine/connect":
        right = parse_qs(url.query)["password"][0] == KEY
        return handler.answer(200, {"sessionKey": "abc"}) if right else handler.answer(403)
    if handler.headers.get("X-Session-Key") != "abc":
        return handler.answer(403)
    if path == "/machine/status":
        return handler.answer(
            200, {"state": {"status": "processing" if host.how.get("printing") else "idle"}}
        )
    if path.startswith("/machine/file/gcodes/"):
        if host.how.get("full"):
            return handler.answer(500)
        _stored(host, path.removeprefix("/machine/file/gcodes/"), data)
        return handler.answer(201)
    if path.startswith("/machine/fileinfo/gcodes/"):
        return handler.answer(200, {"size": len(host.files[path.removeprefix("/machine/fileinfo/gcodes/")])})
    if path == "/machine/code":
        host.started.append(re.fullmatch(rb'M32 "0:/gcodes/(.*)"', data)[1].decode())
    return handler.answer(200)


def redirecting(handler, host, url, data):
    """Sends everybody elsewhere."""
    handler.answer(302, Location="https://elsewhere.example/login?next=x")


def any_status(handler, host, url, data):
    """Answers all with one status and a page."""
    handler.answer(host.how["status"], host.how.get("content"))


ANSWERS = {
    "prusalink": prusalink,
    "duet": duet,
    "duet_with_computer": duet_with_computer,
    "redirecting": redirecting,
    "status": any_status,
}

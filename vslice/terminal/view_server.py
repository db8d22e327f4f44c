"""The process that shows a job to browsers on this computer: a script of its own, with nothing but Python.

It is a process apart so that whatever browsers do costs the sender nothing but what the system gives to
both, and it takes the lower priority. From standard input come lines of JSON: first {"page": HTML, "token":
text}, then the state of the job each time that it changed. To standard output go {"port": number}, and then
one line for each wish: "pause", "resume" or "stop". When standard input ends, it answers a little longer.
"""

import hmac
import json
import os
import signal
import sys
import threading
import time
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

LAST_WORDS_S = 3.0
"""How long pages may still ask how the job ended."""

WISHES = ("pause", "resume", "stop")
NAMES = ("127.0.0.1", "localhost")
IDLE_S = 10.0
NICER = 10


class Shown:
    """What all requests share."""

    def __init__(self, page: str, token: str) -> None:
        self.page, self.token = page.encode(), token
        self.state = b"{}"
        self.port = 0


class Handler(BaseHTTPRequestHandler):
    """Answers browsers: the page and the state to anybody on this computer, wishes to who has the token."""

    protocol_version = "HTTP/1.1"
    timeout = IDLE_S
    shown: Shown

    def do_GET(self) -> None:
        if not self._is_for_us():
            self._answer(403, "text/plain", b"only for this computer")
        elif self.path == "/":
            self._answer(200, "text/html; charset=utf-8", self.shown.page)
        elif self.path == "/state":
            self._answer(200, "application/json", self.shown.state)
        else:
            self._answer(404, "text/plain", b"there is / and /state")

    def do_POST(self) -> None:
        self.close_connection = True  # whatever follows is not read
        wish, token = self.path[1:], self.headers.get("X-Token", "")
        if not self._is_for_us() or not hmac.compare_digest(token.encode(), self.shown.token.encode()):
            self._answer(403, "text/plain", b"the token is another")
        elif wish not in WISHES:
            self._answer(404, "text/plain", b"pause, resume or stop")
        else:
            with suppress(OSError):  # the job has ended
                print(wish, flush=True)
            self._answer(200, "text/plain", b"taken")

    def _is_for_us(self) -> bool:
        """Whether the browser means this server, by name: a name of elsewhere that leads here is a trick."""
        host, _, port = self.headers.get("Host", "").rpartition(":")
        origin = self.headers.get("Origin")
        ours = {f"http://{name}:{self.shown.port}" for name in NAMES}
        return host in NAMES and port == str(self.shown.port) and (origin is None or origin in ours)

    def _answer(self, code: int, kind: str, body: bytes) -> None:
        self.send_response(code)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("X-Frame-Options", "DENY")
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:
        """Standard error is the user's terminal."""


def main() -> None:
    """Serve until standard input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the job
    if hasattr(os, "nice"):
        os.nice(NICER)
    first = json.loads(sys.stdin.readline())
    shown = Shown(first["page"], first["token"])
    Handler.shown = shown
    server = ThreadingHTTPServer((NAMES[0], 0), Handler)
    server.daemon_threads = True
    server.handle_error = lambda *_: None  # type: ignore[method-assign]  # a browser that went away
    shown.port = server.server_address[1]
    threading.Thread(target=server.serve_forever, daemon=True).start()
    print(json.dumps({"port": shown.port}), flush=True)
    for line in sys.stdin:
        shown.state = line.strip().encode()
    time.sleep(LAST_WORDS_S)


if __name__ == "__main__":
    main()

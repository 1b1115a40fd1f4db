"""A receiver of notifications on 127.0.0.1: it keeps what it gets, refuses, redirects, or hangs until it is let go."""

from __future__ import annotations

import json
import threading
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, HTTPServer
from typing import Any

SECRET = "s3cret-t0ken"


@dataclass
class Receiver:
    """The received requests, by path; `status` is the answer, and while `held` is not set there is none."""

    status: int = 200
    port: int = 0
    came: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    headers: list[dict[str, str]] = field(default_factory=list[dict[str, str]])
    held: threading.Event = field(default_factory=threading.Event)
    asked: threading.Event = field(default_factory=threading.Event)

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}/{SECRET}"


@contextmanager
def receiver(status: int = 200, *, hangs: bool = False) -> Generator[Receiver]:
    """A server on a thread, ended at the end."""
    got = Receiver(status)
    if not hangs:
        got.held.set()

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            got.asked.set()
            got.held.wait(30)
            got.came.append(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
            got.headers.append(dict(self.headers.items()))
            self.send_response(got.status)
            self.send_header("Location", f"http://127.0.0.1:{got.port}/elsewhere")
            self.end_headers()

        def log_message(self, format: str, *args: Any) -> None:
            """Nothing is printed."""

    server = HTTPServer(("127.0.0.1", 0), Handler)
    got.port = server.server_port
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    try:
        yield got
    finally:
        got.held.set()
        server.shutdown()
        thread.join()
        server.server_close()

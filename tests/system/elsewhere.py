"""Hears every request by which a browser would leave this computer: it is the browser's proxy, and answers nobody."""

from __future__ import annotations

import contextlib
import socketserver
import threading
from collections.abc import Generator


class Elsewhere(socketserver.ThreadingTCPServer):
    """A proxy on the loopback address; browsers ask it for everything but this computer's own names."""

    daemon_threads = True

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.asked: list[str] = []
        """The first line of each request, such as "CONNECT fonts.googleapis.com:443 HTTP/1.1"."""

    @property
    def url(self) -> str:
        """The proxy's address."""
        return f"http://127.0.0.1:{self.server_address[1]}"

    @property
    def word(self) -> str:
        """The word with which Chromium takes it as its proxy."""
        return f"--proxy-server={self.url}"


class _Handler(socketserver.StreamRequestHandler):
    def handle(self) -> None:
        server = self.server
        assert isinstance(server, Elsewhere)
        server.asked.append(self.rfile.readline(4096).decode(errors="replace").strip())


@contextlib.contextmanager
def elsewhere() -> Generator[Elsewhere]:
    """The proxy while the context lasts."""
    with Elsewhere() as server:
        threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True).start()
        yield server
        server.shutdown()

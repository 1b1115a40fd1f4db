"""Hands Rerun's page on to the browser with a policy that keeps the browser from asking anybody but this computer.

The page asks the internet for a font and for news, and sends usage figures. Rerun's own server has no switch for it, so
a server on the loopback address stands before it: it takes the links to fonts out of the page, and sends the header
Content-Security-Policy, which every browser obeys (https://www.w3.org/TR/CSP3/).
"""

from __future__ import annotations

import http.client
import re
import threading
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, cast

from shared.page.access import is_local

LOOPBACK = "127.0.0.1"
_TIMEOUT_S = 60.0
"""Rerun's server hands out 40 MB from memory; a busy machine takes some seconds."""
_ELSEWHERE = re.compile(rb"""<link\b[^>]*\bhref=["']https?://[^>]*>""")
"""Links of the page's head that lead away: a policy does not stop a mere connection (`rel="preconnect"`)."""
_HANDED_ON = ("Content-Type", "Content-Encoding", "rerun-final-length")
"""Headers of Rerun's server that its page needs; the last is the size by which it shows how much has been loaded."""


def policy(data_port: int) -> str:
    """Returns the policy of the viewer's page, which reads its data from a port of this computer, and nothing else."""
    return (
        "default-src 'none'; script-src 'self' 'unsafe-inline' 'wasm-unsafe-eval'; style-src 'self' 'unsafe-inline'; "
        f"connect-src 'self' http://{LOOPBACK}:{data_port}; img-src 'self' data: blob:; font-src 'self' data:; "
        "worker-src 'self' blob:; base-uri 'none'; form-action 'none'; "
        f"frame-ancestors http://{LOOPBACK}:* http://localhost:*"
    )


class Relay(ThreadingHTTPServer):
    """Serves Rerun's page from another port of the loopback address, until it is closed."""

    daemon_threads = True

    def __init__(self, page_port: int, *, data_port: int) -> None:
        """Listens, and serves on a thread of its own; Rerun's server is at `page_port`, its data at `data_port`."""
        super().__init__((LOOPBACK, 0), _Handler)
        self.page_port, self.policy = page_port, policy(data_port)
        threading.Thread(target=self.serve_forever, name="relay", daemon=True).start()

    def close(self) -> None:
        """Serves nobody any more."""
        self.shutdown()
        self.server_close()


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "repose", ""
    timeout = _TIMEOUT_S

    def log_message(self, format: str, *args: Any) -> None:
        """Says nothing: the terminal is the session's."""

    def do_GET(self) -> None:
        """Asks Rerun's server, and hands its answer on."""
        if not is_local(self.headers.get("Host", "")):
            self.send_error(HTTPStatus.MISDIRECTED_REQUEST)
            return
        try:
            status, headers, body = self._asked()
        except (OSError, http.client.HTTPException):
            self.send_error(HTTPStatus.BAD_GATEWAY, "Rerun's viewer has ended")
            return
        self.send_response(status)
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def _asked(self) -> tuple[int, dict[str, str], bytes]:
        server = cast(Relay, self.server)
        asking = http.client.HTTPConnection(LOOPBACK, server.page_port, timeout=_TIMEOUT_S)
        try:
            asking.request("GET", self.path)
            answer = asking.getresponse()
            body = answer.read()
        finally:
            asking.close()
        headers = {name: value for name in _HANDED_ON if (value := answer.getheader(name))}
        if headers.get("Content-Type", "").startswith("text/html"):
            body = _ELSEWHERE.sub(b"", body)
        own = {"Content-Length": str(len(body)), "Content-Security-Policy": server.policy, "Cache-Control": "no-store"}
        return answer.status, headers | own, body

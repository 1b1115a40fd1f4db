"""The page's server: Python's own, on the loopback address, with server-sent events for what changes.

| request | answer |
|---|---|
| `GET /?token=…` | sets the cookie and leads to the page; everything else needs the cookie |
| `GET /`, `/page.css`, `/page.js` | the page, the same for all |
| `GET /events` | a stream: `state` several times a second, `samples` and `curve` when there are new ones |
| `GET /recordings` | the recordings of the folder |
| `GET /made/KIND/NAME` | the report or the diagnosis of a recording, as a page without scripts |
| `POST /do/ACTION` | an action (`Backend.act`), with the token in a header; 409 and a sentence where it is refused |
"""

from __future__ import annotations

import json
import threading
import time
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from typing import Any, cast
from urllib.parse import parse_qs, unquote, urlsplit

from shared.errors import UserError
from station.app.outputs import without_nan
from station.app.serve.access import Access, is_local
from station.app.serve.backend import Backend
from station.app.serve.follower import told
from station.app.serve.shelf import DIAGNOSIS, REPORT

LOOPBACK = "127.0.0.1"
_STATIC = {
    "/": ("index.html", "text/html"),
    "/page.css": ("page.css", "text/css"),
    "/page.js": ("page.js", "text/javascript"),
}
_MOST_BYTES = 65_536
_EVERY_S, _SILENT_S = 0.25, 5.0
_PAGE_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; "
    "frame-src http://127.0.0.1:* http://localhost:*; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_MADE_POLICY = "sandbox; default-src 'none'; style-src 'unsafe-inline'; img-src data:; frame-ancestors 'none'"
_ALWAYS = {
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
}


class PageServer(ThreadingHTTPServer):
    """Serves one backend; `serve_forever` on a thread of its own, `close` from another one."""

    daemon_threads = True
    allow_reuse_address = True

    def __init__(self, backend: Backend, *, port: int, token: str) -> None:
        """Listens at once.

        Raises:
            UserError: if the port is taken.
        """
        self.backend, self.closing = backend, threading.Event()
        try:
            super().__init__((LOOPBACK, port), _Handler)
        except OSError as error:
            raise UserError(
                f"Expected to listen on {LOOPBACK}:{port}, but that failed ({error.strerror}); is the page served "
                "already? Choose another port with --port"
            ) from error
        self.access = Access(token, port=self.server_port)

    @property
    def url(self) -> str:
        """The address that lets a browser in."""
        return f"http://{LOOPBACK}:{self.server_port}/?token={self.access.token}"

    def close(self) -> None:
        """Ends the streams and stops listening."""
        self.closing.set()
        self.shutdown()
        self.server_close()


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server_version = "station"
    sys_version = ""
    timeout = 30

    @property
    def _server(self) -> PageServer:
        return cast(PageServer, self.server)

    def log_message(self, format: str, *args: Any) -> None:
        """Says nothing: the address holds the token."""

    # --- reading -----------------------------------------------------------------------------------------------------

    def do_GET(self) -> None:
        """Answers a request for the page or a part of it."""
        url = urlsplit(self.path)
        if not is_local(self.headers.get("Host", "")):
            self._refuse(HTTPStatus.MISDIRECTED_REQUEST, "Expected this computer's own name as Host")
        elif url.path == "/" and (token := parse_qs(url.query).get("token", [""])[0]):
            self._let_in(token)
        elif not self._server.access.may_read(dict(self.headers)):
            self._refuse(HTTPStatus.FORBIDDEN, "Open the link that `station serve` has printed: it holds the key")
        elif url.path in _STATIC:
            self._send_static(*_STATIC[url.path])
        elif url.path == "/events":
            self._stream()
        elif url.path == "/recordings":
            self._send_json({"recordings": self._server.backend.shelf.listed()})
        elif url.path.startswith("/made/"):
            self._send_made(unquote(url.path.removeprefix("/made/")))
        else:
            self._refuse(HTTPStatus.NOT_FOUND, "There is nothing here")

    def _let_in(self, token: str) -> None:
        if not self._server.access.knows(token):
            self._refuse(HTTPStatus.FORBIDDEN, "This link is old: open the one that `station serve` has printed last")
            return
        self._send(HTTPStatus.SEE_OTHER, b"", {"Location": "/", "Set-Cookie": self._server.access.set_cookie()})

    def _send_static(self, name: str, kind: str) -> None:
        text = (files("station.app.serve") / "pages" / name).read_text(encoding="utf-8")
        if name == "index.html":
            text = text.replace("$token", self._server.access.token)
        headers = {"Content-Type": f"{kind}; charset=utf-8", "Content-Security-Policy": _PAGE_POLICY}
        self._send(HTTPStatus.OK, text.encode(), headers)

    def _send_made(self, what: str) -> None:
        kind, _, name = what.partition("/")
        shelf = self._server.backend.shelf
        try:
            if kind not in (REPORT, DIAGNOSIS):
                raise UserError(f"Expected {REPORT} or {DIAGNOSIS}, got '{kind}'")
            page = shelf.page(shelf.path(name), kind).read_bytes()
        except (UserError, OSError) as error:
            self._refuse(HTTPStatus.NOT_FOUND, str(error))
            return
        headers = {"Content-Type": "text/html; charset=utf-8", "Content-Security-Policy": _MADE_POLICY}
        self._send(HTTPStatus.OK, page, headers)

    # --- the stream --------------------------------------------------------------------------------------------------

    def _stream(self) -> None:
        """Sends what is new until the browser is gone; a page that connects again is told everything again."""
        self.send_response(HTTPStatus.OK)
        for name, value in (_ALWAYS | {"Content-Type": "text/event-stream", "Connection": "close"}).items():
            self.send_header(name, value)
        self.end_headers()
        self.close_connection = True
        try:
            for event, data in self._news():
                self.wfile.write(f"event: {event}\ndata: {json.dumps(data)}\n\n".encode())
                self.wfile.flush()
        except OSError:
            return

    def _news(self) -> Any:
        backend = self._server.backend
        last, last_s, session, count, version = None, 0.0, 0, 0, -1
        while not self._server.closing.is_set():
            began, samples, _ = backend.follower.samples()
            if began != session or len(samples) > count:
                fresh = samples if began != session else samples[count:]
                session, count = began, len(samples)
                yield "samples", {"session": session, "samples": told(fresh)}
            state = without_nan(backend.state())
            if state != last or time.monotonic() - last_s > _SILENT_S:
                last, last_s = state, time.monotonic()
                yield "state", state
            if backend.curve.version != version:
                version = backend.curve.version
                yield "curve", backend.curve.told
            self._server.closing.wait(_EVERY_S)

    # --- acting ------------------------------------------------------------------------------------------------------

    def do_POST(self) -> None:
        """Does what a page asks for."""
        body = self._body()
        if not is_local(self.headers.get("Host", "")):
            self._refuse(HTTPStatus.MISDIRECTED_REQUEST, "Expected this computer's own name as Host")
        elif not self._server.access.may_act(dict(self.headers)):
            self._refuse(HTTPStatus.FORBIDDEN, "Load the page again: this one is not allowed to act")
        elif not self.path.startswith("/do/"):
            self._refuse(HTTPStatus.NOT_FOUND, "There is nothing here")
        else:
            self._act(self.path.removeprefix("/do/"), body)

    def _body(self) -> bytes:
        length = self.headers.get("Content-Length", "")
        if not length.isdigit() or int(length) > _MOST_BYTES:
            self.close_connection = True  # what follows is no request
            return b""
        return self.rfile.read(int(length))

    def _act(self, name: str, body: bytes) -> None:
        try:
            asked = json.loads(body)
            if not isinstance(asked, dict):
                raise UserError("Expected a JSON object")
            self._server.backend.act(name, cast("dict[str, Any]", asked))
        except ValueError:
            self._refuse(HTTPStatus.BAD_REQUEST, "Expected a JSON object")
        except (UserError, OSError) as error:
            self._refuse(HTTPStatus.CONFLICT, str(error))
        else:
            self._send_json({})

    # --- answers -----------------------------------------------------------------------------------------------------

    def _refuse(self, status: HTTPStatus, sentence: str) -> None:
        self._send(status, f"{sentence}\n".encode(), {"Content-Type": "text/plain; charset=utf-8"})

    def _send_json(self, value: Any) -> None:
        self._send(HTTPStatus.OK, json.dumps(value).encode(), {"Content-Type": "application/json"})

    def _send(self, status: HTTPStatus, body: bytes, headers: dict[str, str]) -> None:
        self.send_response(status)
        for name, value in (_ALWAYS | headers | {"Content-Length": str(len(body))}).items():
            self.send_header(name, value)
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)

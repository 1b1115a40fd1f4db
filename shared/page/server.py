"""The server of a page: Python's own, on the loopback address, with server-sent events for what changes.

| request | answer |
|---|---|
| `GET /?token=…` | sets the cookie and leads to the page; everything else needs the cookie |
| `GET /`, `/base.css`, `/base.js` | the page, and what all pages have alike |
| `GET /page.css`, `/page.js` | what this page has of its own |
| `GET /events` | a stream of what changes (`Handler.news`) |
| any other `GET` | what the page's own `Handler.look` gives for it |
| `POST /do/ACTION` | an action (`Handler.act`), with the token in a header; 409 and a sentence where it is refused |
"""

from __future__ import annotations

import json
import logging
import socket
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from typing import Any, ClassVar, cast
from urllib.parse import parse_qs, unquote, urlsplit

from shared.errors import UserError
from shared.page.access import Access, is_local
from shared.page.strangers import MOST, Strangers

_LOG = logging.getLogger(__name__)
LOOPBACK = "127.0.0.1"
_KINDS = {
    "/base.css": "text/css",
    "/page.css": "text/css",
    "/base.js": "text/javascript",
    "/page.js": "text/javascript",
}
_MOST_BYTES = 65_536
"""The longest body of an action, bytes: pages of ours send the name of a recording and a few numbers."""
_PAGE_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; "
    "frame-src http://127.0.0.1:* http://localhost:*; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_ALWAYS = {
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
}


class LoopbackServer(ThreadingHTTPServer):
    """Serves one page; `serve_forever` on a thread of its own, `close` from another one."""

    daemon_threads = True
    allow_reuse_address = True
    request_queue_size = MOST
    """Connections that wait to be taken: with Python's 5, a burst of them keeps the next one waiting for a second."""

    def __init__(self, handler: type[Handler], *, port: int, token: str) -> None:
        """Listens at once.

        Raises:
            UserError: if the port is taken.
        """
        self.closing = threading.Event()
        self.strangers = Strangers()
        try:
            super().__init__((LOOPBACK, port), handler)
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

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answers a connection on a thread of its own; it is a stranger until a request of it shows the key."""
        self.strangers.come(cast(socket.socket, request), time.monotonic())
        super().process_request(request, client_address)

    def close_request(self, request: Any) -> None:
        """Closes a connection."""
        self.strangers.go(cast(socket.socket, request))
        super().close_request(request)

    def service_actions(self) -> None:
        """Ends strangers whose time is over; called after each connection, and twice a second without any."""
        self.strangers.end_old(time.monotonic())

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Tells in one line what ended a request without an answer; a browser that goes away is no mistake."""
        del request, client_address
        error = sys.exc_info()[1]
        if not isinstance(error, ConnectionError):
            _LOG.error("the page did not answer a request (%s: %s); report this", type(error).__name__, error)

    def close(self) -> None:
        """Ends the streams and stops listening."""
        self.closing.set()
        self.shutdown()
        self.server_close()


class Handler(BaseHTTPRequestHandler):
    """Answers one request; a page derives its own from it, with what it shows and what it does."""

    protocol_version = "HTTP/1.1"
    server_version = "repose"
    sys_version = ""
    timeout = 30
    package: ClassVar[str] = ""
    """The package whose folder `pages` holds index.html, page.css and page.js."""
    command_line: ClassVar[str] = ""
    """The command that serves the page, for sentences."""

    def look(self, path: str, query: Mapping[str, list[str]]) -> bool:
        """Answers a request for a part of the page; False if there is no such part."""
        raise NotImplementedError

    def news(self) -> Iterator[tuple[str, Any]]:
        """Returns the events of the stream, each a name and a value for JSON, until the server closes."""
        raise NotImplementedError

    def act(self, name: str, asked: Mapping[str, Any]) -> None:
        """Does what the page asks for.

        Raises:
            UserError: saying in a sentence why not.
        """
        raise NotImplementedError

    @property
    def _access(self) -> Access:
        return cast(LoopbackServer, self.server).access

    def parse_request(self) -> bool:
        """Reads the head of a request; one with the key makes its connection known."""
        parsed = super().parse_request()
        if parsed and self._access.may_read(dict(self.headers)):
            cast(LoopbackServer, self.server).strangers.go(self.connection)
        return parsed

    def log_message(self, format: str, *args: Any) -> None:
        """Says nothing: the address holds the token."""

    # --- reading -----------------------------------------------------------------------------------------------------

    def do_GET(self) -> None:
        """Answers a request for the page or a part of it."""
        try:
            url = urlsplit(self.path)
        except ValueError:  # a bracket that is none of an address
            self.refuse(HTTPStatus.BAD_REQUEST, "Expected a path on this page")
            return
        query = parse_qs(url.query)
        if not is_local(self.headers.get("Host", "")):
            self.refuse(HTTPStatus.MISDIRECTED_REQUEST, "Expected this computer's own name as Host")
        elif url.path == "/" and (token := query.get("token", [""])[0]):
            self._let_in(token)
        elif not self._access.may_read(dict(self.headers)):
            self.refuse(HTTPStatus.FORBIDDEN, f"Open the link that `{self.command_line}` has printed: it holds the key")
        elif url.path == "/" or url.path in _KINDS:
            self._send_static(url.path)
        elif url.path == "/events":
            self._stream()
        elif not self.look(unquote(url.path), query):
            self.refuse(HTTPStatus.NOT_FOUND, "There is nothing here")

    def _let_in(self, token: str) -> None:
        if not self._access.knows(token):
            self.refuse(
                HTTPStatus.FORBIDDEN, f"This link is old: open the one that `{self.command_line}` has printed last"
            )
            return
        self.send(HTTPStatus.SEE_OTHER, b"", {"Location": "/", "Set-Cookie": self._access.set_cookie()})

    def _send_static(self, path: str) -> None:
        name = path.removeprefix("/") or "index.html"
        folder = files("shared.page") if name.startswith("base.") else files(self.package) / "pages"
        text = (folder / name).read_text(encoding="utf-8")
        if name == "index.html":
            text = text.replace("$token", self._access.token)
        kind = _KINDS.get(path, "text/html")
        headers = {"Content-Type": f"{kind}; charset=utf-8", "Content-Security-Policy": _PAGE_POLICY}
        self.send(HTTPStatus.OK, text.encode(), headers)

    def _stream(self) -> None:
        """Sends what is new until the browser is gone; a page that connects again is told everything again."""
        self.send_response(HTTPStatus.OK)
        for name, value in (_ALWAYS | {"Content-Type": "text/event-stream", "Connection": "close"}).items():
            self.send_header(name, value)
        self.end_headers()
        self.close_connection = True
        try:
            for event, data in self.news():
                self.wfile.write(f"event: {event}\ndata: {json.dumps(data)}\n\n".encode())
                self.wfile.flush()
        except OSError:
            return

    # --- acting ------------------------------------------------------------------------------------------------------

    def do_POST(self) -> None:
        """Does what a page asks for."""
        body = self._body()
        if not is_local(self.headers.get("Host", "")):
            self.refuse(HTTPStatus.MISDIRECTED_REQUEST, "Expected this computer's own name as Host")
        elif not self._access.may_act(dict(self.headers)):
            self.refuse(HTTPStatus.FORBIDDEN, "Load the page again: this one is not allowed to act")
        elif not self.path.startswith("/do/"):
            self.refuse(HTTPStatus.NOT_FOUND, "There is nothing here")
        else:
            self._act(self.path.removeprefix("/do/"), body)

    def _body(self) -> bytes:
        length = _length_of(self.headers.get("Content-Length", ""))
        if length is None:
            self.close_connection = True  # the bytes that follow are no request
            return b""
        return self.rfile.read(length)

    def _act(self, name: str, body: bytes) -> None:
        try:
            asked = json.loads(body)
        except (ValueError, RecursionError):  # wrong letters, JSON or numbers; brackets within brackets
            self.refuse(HTTPStatus.BAD_REQUEST, "Expected a JSON object")
            return
        try:
            if not isinstance(asked, dict):
                raise UserError("Expected a JSON object")
            self.act(name, cast("dict[str, Any]", asked))
        except (UserError, OSError) as error:
            self.refuse(HTTPStatus.CONFLICT, str(error))
        else:
            self.send_json({})

    # --- answers -----------------------------------------------------------------------------------------------------

    def refuse(self, status: HTTPStatus, sentence: str) -> None:
        """Answers with a sentence that says why not."""
        self.send(status, f"{sentence}\n".encode(errors="replace"), {"Content-Type": "text/plain; charset=utf-8"})

    def send_json(self, value: Any) -> None:
        """Answers with a value."""
        self.send(HTTPStatus.OK, json.dumps(value).encode(), {"Content-Type": "application/json"})

    def send(self, status: HTTPStatus, body: bytes, headers: Mapping[str, str]) -> None:
        """Answers with bytes."""
        self.send_response(status)
        for name, value in (_ALWAYS | dict(headers) | {"Content-Length": str(len(body))}).items():
            self.send_header(name, value)
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)


def _length_of(header: str) -> int | None:
    """Returns the length of a body, bytes; None if the header is no number, or one beyond the bodies of our pages."""
    if not (header.isascii() and header.isdigit() and len(header) <= len(str(_MOST_BYTES))):
        return None
    return length if (length := int(header)) <= _MOST_BYTES else None

"""The station's page: the parts that it shows and the actions that it does, for the server in `shared.page.server`.

| request | answer |
|---|---|
| `GET /events` | a stream: `state` several times a second, `samples` and `curve` when there are new ones |
| `GET /recordings` | the recordings of the folder |
| `GET /made/KIND/NAME` | the report or the diagnosis of a recording, as a page without scripts |
| `POST /do/ACTION` | an action of the `Backend` |
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from http import HTTPStatus
from typing import Any, cast

from shared.errors import UserError
from shared.page.server import Handler, LoopbackServer
from station.app.outputs import without_nan
from station.app.serve.backend import Backend
from station.app.serve.follower import table_rows
from station.app.serve.shelf import DIAGNOSIS, REPORT

_EVERY_S, _SILENT_S = 0.25, 5.0
_MADE_POLICY = "sandbox; default-src 'none'; style-src 'unsafe-inline'; img-src data:; frame-ancestors 'none'"


class PageServer(LoopbackServer):
    """Serves one backend; `serve_forever` on a thread of its own, `close` from another one."""

    def __init__(self, backend: Backend, *, port: int, token: str) -> None:
        """Listens at once.

        Raises:
            UserError: if the port is taken.
        """
        self.backend = backend
        super().__init__(_Handler, port=port, token=token)


class _Handler(Handler):
    package = "station.app.serve"
    command_line = "station serve"

    @property
    def _server(self) -> PageServer:
        return cast(PageServer, self.server)

    def look(self, path: str, query: Mapping[str, list[str]]) -> bool:
        """Answers a request for the list of recordings or for a report made of one; returns false for any other."""
        del query
        if path == "/recordings":
            self.send_json({"recordings": self._server.backend.shelf.listed()})
        elif path.startswith("/made/"):
            self._send_made(path.removeprefix("/made/"))
        else:
            return False
        return True

    def _send_made(self, what: str) -> None:
        kind, _, name = what.partition("/")
        shelf = self._server.backend.shelf
        try:
            if kind not in (REPORT, DIAGNOSIS):
                raise UserError(f"Expected {REPORT} or {DIAGNOSIS}, got '{kind}'")
            page = shelf.page(shelf.path(name), kind).read_bytes()
        except (UserError, OSError) as error:
            self.refuse(HTTPStatus.NOT_FOUND, str(error))
            return
        headers = {"Content-Type": "text/html; charset=utf-8", "Content-Security-Policy": _MADE_POLICY}
        self.send(HTTPStatus.OK, page, headers)

    def news(self) -> Iterator[tuple[str, Any]]:
        """Yields new samples, the state of the session and the limit curve, each when it has changed."""
        backend = self._server.backend
        last, last_s, session, count, version = None, 0.0, 0, 0, -1
        while not self._server.closing.is_set():
            began, samples, _ = backend.follower.samples()
            if began != session or len(samples) > count:
                fresh = samples if began != session else samples[count:]
                session, count = began, len(samples)
                yield "samples", {"session": session, "samples": table_rows(fresh)}
            state = without_nan(backend.state())
            if state != last or time.monotonic() - last_s > _SILENT_S:
                last, last_s = state, time.monotonic()
                yield "state", state
            if backend.curve.version != version:
                version = backend.curve.version
                yield "curve", backend.curve.state
            self._server.closing.wait(_EVERY_S)

    def act(self, name: str, asked: Mapping[str, Any]) -> None:
        """Hands what the page asks for to the backend."""
        self._server.backend.act(name, asked)

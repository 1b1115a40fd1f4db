"""The camera's page: the parts that it shows and the actions that it does, for the server in `shared.page.server`.

| request | answer |
|---|---|
| `GET /events` | a stream: `state`, as often as a picture is measured |
| `GET /picture.jpg`, `/mark.png` | the newest picture; the part of it about the mark, enlarged |
| `GET /calibration.png`, `/calibration.toml` | the calibration that was made here |
| `POST /do/expose`, `/do/board`, `/do/calibrate` | another exposure; keep a picture of the board; calibrate |
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from http import HTTPStatus
from typing import Any, TypeVar, cast

import cv2
import numpy as np

from pi_agent.cameras import Image
from pi_agent.page.eye import Eye
from pi_agent.page.seen import Seen
from pi_agent.preview import encode
from shared.page import asked as read
from shared.page.server import Handler, LoopbackServer

T = TypeVar("T")
_QUALITY = 85
_EVERY_S = 0.05
_ENLARGED = 4
_ABOUT_PX = 50
"""Half of the side of the part about the mark, where the mark is not found."""


class EyeServer(LoopbackServer):
    """Serves the page of one camera; `serve_forever` on a thread of its own, `close` from another one."""

    def __init__(self, eye: Eye, *, port: int, token: str) -> None:
        """Listens at once.

        Raises:
            UserError: if the port is taken.
        """
        self.eye = eye
        super().__init__(_Handler, port=port, token=token)


class _Handler(Handler):
    package = "pi_agent.page"
    command_line = "pi-agent serve"

    @property
    def _server(self) -> EyeServer:
        return cast(EyeServer, self.server)

    @property
    def _eye(self) -> Eye:
        return self._server.eye

    def look(self, path: str, query: Mapping[str, list[str]]) -> bool:
        """Answers a request for a picture or for the calibration; returns false if there is none, or for any other."""
        del query
        shown: dict[str, Callable[[], bytes | None]] = {
            "/picture.jpg": lambda: _of(self._eye.seen, lambda seen: encode(seen.image, quality=_QUALITY)),
            "/mark.png": lambda: _of(self._eye.seen, lambda seen: _png(about_mark(seen))),
            "/calibration.png": lambda: _of(self._eye.kept, lambda kept: kept.picture.read_bytes()),
            "/calibration.toml": lambda: _of(self._eye.kept, lambda kept: kept.file.read_bytes()),
        }
        data = shown[path]() if path in shown else None
        if data is None:
            return False
        kind = {"jpg": "image/jpeg", "png": "image/png"}.get(path[-3:], "application/toml")
        self.send(HTTPStatus.OK, data, {"Content-Type": kind})
        return True

    def news(self) -> Iterator[tuple[str, Any]]:
        """Yields the camera's state when it has changed."""
        last = None
        while not self._server.closing.is_set():
            state = self._eye.state()
            if state != last:
                last = state
                yield "state", state
            self._server.closing.wait(_EVERY_S)

    def act(self, name: str, asked: Mapping[str, Any]) -> None:
        """Sets the exposure, keeps a view of the board, or calibrates."""
        if name == "expose":
            self._eye.expose(read.number(asked, "exposure_ms"))
        elif name == "board":
            self._eye.keep_board()
        elif name == "calibrate":
            self._eye.calibrate(with_lens=read.flag(asked, "lens"))
        else:
            raise read.unknown(name, ("expose", "board", "calibrate"))


def about_mark(seen: Seen) -> Image:
    """Returns the part of a picture (height, width) about the mark, or its middle, each pixel drawn large."""
    height, width = seen.image.shape
    middle, half = np.array([width / 2, height / 2]), float(_ABOUT_PX)
    if seen.corners.found:
        corners = np.reshape(seen.corners.corners_px, (4, 2))
        middle = corners.mean(axis=0)
        half = 1.3 * float(np.abs(corners - middle).max())
    left, top = (max(round(float(value - half)), 0) for value in middle)
    part = seen.image[top : top + round(2 * half), left : left + round(2 * half)]
    return np.asarray(np.kron(part, np.ones((_ENLARGED, _ENLARGED), dtype=np.uint8)))


def _png(image: Image) -> bytes:
    return cv2.imencode(".png", image)[1].tobytes()


def _of(value: T | None, made: Callable[[T], bytes]) -> bytes | None:
    return None if value is None else made(value)

"""A part of the view: it takes some topics and draws some entities. Parts do not know of each other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from station.view.canvas import Canvas
from station.view.setup import Setup

Handler = Callable[[Any], None]
"""Takes a message of the topic's class, at the canvas's present time."""


@dataclass(frozen=True, kw_only=True)
class Rates:
    """The largest numbers a second (None: all) of images and of what else is drawn anew; curves have every point."""

    image_hz: float | None = None
    drawing_hz: float | None = 25.0


class Part(Protocol):
    """Draws what its topics say."""

    def handlers(self) -> Mapping[str, Handler]:
        """Returns the handlers of the topics that it takes.

        A name that ends in `/` stands for every topic that begins so.
        """
        ...


PartMaker = Callable[[Canvas, Setup, Rates], Part]

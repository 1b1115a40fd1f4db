"""One file a figure, found by being here: NUMBER (its place), CAPTION, INTERVAL, draw(pair) -> Figure."""

from __future__ import annotations

import importlib
import pkgutil
from dataclasses import dataclass

from station.friction.drawing import Draw


@dataclass(frozen=True, slots=True)
class FigureKind:
    """A figure that every surface pair gets: what it shows, and what its bars and bands are (empty: it has none)."""

    name: str
    number: float
    caption: str
    interval: str
    draw: Draw


def figure_kinds() -> tuple[FigureKind, ...]:
    """Returns every figure of this folder, in order of its number."""
    found: list[FigureKind] = []
    for info in pkgutil.iter_modules(__path__):
        module = importlib.import_module(f"{__name__}.{info.name}")
        found.append(FigureKind(info.name, module.NUMBER, module.CAPTION, module.INTERVAL, module.draw))
    return tuple(sorted(found, key=lambda kind: kind.number))

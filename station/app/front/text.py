"""Prints an object: the words of its command, without colours."""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Console, RenderableType

_WIDTH = 120


def as_text(parts: Iterable[RenderableType]) -> str:
    """Returns the parts one below the other, in lines of at most 120 letters; a plain text keeps its lines."""
    console = Console(width=_WIDTH, highlight=False, color_system=None)
    with console.capture() as printed:
        for part in parts:
            console.out(part) if isinstance(part, str) else console.print(part)
    return "\n".join(line.rstrip() for line in printed.get().rstrip().splitlines())

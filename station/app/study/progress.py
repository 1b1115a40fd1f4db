"""Progress where there is no terminal to draw a bar on: a line now and then, with the time that is left."""

from __future__ import annotations

import time
from collections.abc import Callable

from rich.console import Console

EVERY_S = 60.0


class Told:
    """Prints how many samples are done, how long it took and about how long the rest takes; nothing on a terminal."""

    def __init__(self, console: Console, *, total: int, seconds: Callable[[], float] = time.monotonic) -> None:
        self._console, self._total, self._seconds = console, total, seconds
        self._begin = self._last = seconds()

    def at(self, done: int) -> None:
        """`done` of the samples are there."""
        now = self._seconds()
        if self._console.is_terminal or now - self._last < EVERY_S:
            return
        self._last, passed = now, now - self._begin
        left = (
            f"about {passed / done * (self._total - done) / 60:.0f} min left" if done else "the rest is not known yet"
        )
        self._console.print(f"{done} of {self._total} samples in {passed / 60:.0f} min, {left}", soft_wrap=True)

"""Progress of long work: a bar on a terminal; elsewhere a line now and then, with the time that is left."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

EVERY_S = 10.0
"""Between two lines, in a log or a pipe: as long as one waits without wondering."""

MINUTES_FROM_S = 120.0
"""From here on a time is told in minutes."""


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
        left = f"about {_time(passed / done * (self._total - done))} left" if done else "the rest is not known yet"
        self._console.print(f"{done} of {self._total} samples in {_time(passed)}, {left}", soft_wrap=True)


def _time(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < MINUTES_FROM_S else f"{seconds / 60:.0f} min"


@contextmanager
def counted(console: Console, *, total: int) -> Generator[Callable[[int], None]]:
    """A function that is told how many samples are done, and shows it."""
    told = Told(console, total=total)
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        console=console,
        refresh_per_second=2,  # drawn ten times a second, the bar would take a hundredth of a simulated session
        transient=True,
        redirect_stdout=False,
        disable=not console.is_terminal,
    ) as progress:
        task = progress.add_task("samples", total=total)

        def at(done: int) -> None:
            progress.update(task, completed=done)
            told.at(done)

        yield at

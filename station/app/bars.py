"""Progress through a known number of things: a bar on a terminal, and a line every so often in a log."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from station.app.progress import ProgressLines, looked_at

LOOK_S = 0.5
"""Seconds between two looks at work that counts faster than anybody reads."""


def bar(console: Console, *, in_a_log: bool = True) -> Progress:
    """Returns a bar with the time left; in a log it is one line at the end, or with `in_a_log` False nothing."""
    return Progress(
        TextColumn("{task.description:<28}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=console,
        disable=not (in_a_log or console.is_terminal),
    )


@contextmanager
def counting(
    console: Console, title: str, *, total: int, what: str, every_s: float = LOOK_S
) -> Generator[Callable[[int], None]]:
    """Gives a function that takes how many of `total` are done, as often as one likes; a look every so often shows it.

    `what` are these things called, in a log's lines.
    """
    lines, done = ProgressLines(console, total=total, what=what), 0

    def count(number: int) -> None:
        nonlocal done
        done = number

    with bar(console, in_a_log=False) as progress:
        shown = progress.add_task(title, total=total)

        def look() -> None:
            progress.update(shown, completed=done)
            lines.at(done)

        with looked_at(look, every_s=every_s):
            yield count

"""A session in a log or a pipe: the log's lines as they come, and every ten seconds how far it is."""

from __future__ import annotations

from rich.console import Console
from rich.markup import escape

from shared.bus import Bus
from shared.visible import visible
from station.app.progress import ProgressLines


class PlainDisplay:
    """Prints plain lines on the console."""

    def __init__(self, console: Console, *, total: int) -> None:
        self._console, self._progress = console, ProgressLines(console, total=total)

    def __enter__(self) -> PlainDisplay:
        """Returns itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Does nothing: nothing is left to be done."""

    def attach(self, bus: Bus) -> None:
        """Does nothing: the samples' number is told."""

    def line(self, level: str, text: str) -> None:
        """Prints a line of the log.

        Nothing in it is highlighted: the expressions that seek numbers and paths take a time that is the square of the
        length of a word, and the line may quote what a stranger sent.
        """
        self._console.print(f"[dim]{level}[/] {escape(visible(text))}", highlight=False)

    def tell(self, done: int) -> None:
        """Shows that `done` samples are there."""
        self._progress.at(done)

    def end(self, fault: str) -> None:
        """Does nothing: the summary follows."""

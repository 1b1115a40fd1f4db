"""A share as a bar with words beside it."""

from __future__ import annotations

from dataclasses import dataclass

from rich.console import Console, ConsoleOptions, RenderResult
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

_BAR = 20
"""Columns of a bar."""


@dataclass(frozen=True)
class Barred:
    """A share of a total as a bar and in words; in words alone where both have no room beside each other."""

    total: float
    done: float
    words: str

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Draws the bar where it has room, and the words."""
        row = Table.grid(padding=(0, 1))
        row.add_row(ProgressBar(total=self.total, completed=min(self.done, self.total), width=_BAR), self.words)
        yield row if _BAR + 1 + len(self.words) <= options.max_width else Text(self.words)

"""Fits a panel to its terminal: the least important of the rows that have no room are left out, which a row says."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.panel import Panel
from rich.segment import Segment, SegmentLines
from rich.text import Text

WIDTH = 78
"""The widest panel, columns: what a terminal of the usual 80 columns shows whole."""
_FRAME_ROWS = 2
_FRAME_COLUMNS = 4
"""Columns of the panel's borders and of the room beside them."""
INNER = WIDTH - _FRAME_COLUMNS
"""Columns of the widest panel's contents."""
_GAP = 1 << 16
"""The rank of an empty row, which goes before everything else."""

Rows = list[list[Segment]]


@dataclass(frozen=True)
class Part:
    """Rows that are shown together or not at all; those of rank 0 stay the longest, and are cut if they must."""

    rank: int
    content: RenderableType


GAP = Part(_GAP, Text())
"""An empty row between two groups."""


@dataclass(frozen=True)
class Fitted:
    """A panel of parts from top to bottom, in the width and the height of the terminal that it is drawn on."""

    title: str
    parts: Sequence[Part]

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Draws what has room."""
        width = min(WIDTH, options.max_width)
        inner = options.update(width=max(width - _FRAME_COLUMNS, 1), height=None)
        drawn = [(part.rank, console.render_lines(part.content, inner, pad=False)) for part in self.parts]
        shown = fitting(drawn, room=max(options.size.height - _FRAME_ROWS, 1))
        missing = sum(len(rows) for rank, rows in drawn if rank < _GAP) - len(shown)
        if missing > 0:
            shown += console.render_lines(_more(missing), inner, pad=False)[:1]
        yield Panel(SegmentLines(shown, new_lines=True), title=Text(self.title), title_align="left", width=width)


def _more(missing: int) -> Text:
    return Text(f"… {missing} more row{'s' * (missing != 1)} in a larger terminal", style="dim", overflow="ellipsis")


def fitting(drawn: Sequence[tuple[int, Rows]], *, room: int) -> Rows:
    """Returns the rows that have room, in their order; one row less where a part is left out, to say so."""
    for least in (_GAP, _GAP - 1):
        wanted = [rows for rank, rows in drawn if rank <= least]
        if sum(map(len, wanted)) <= room:
            return [row for rows in wanted for row in rows]
    shown: dict[int, Rows] = {}
    left = room - 1
    for index, (rank, rows) in sorted(enumerate(drawn), key=lambda one: one[1][0]):
        if rank < _GAP and (len(rows) <= left or rank == 0):
            shown[index] = rows[:left]
            left -= len(shown[index])
    return [row for index in sorted(shown) for row in shown[index]]

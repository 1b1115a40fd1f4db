"""A session on a terminal: one panel that is drawn anew in its place."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.panel import Panel
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from shared.bus import Bus
from station.app.display.moment import Direction, Health, Moment
from station.app.display.watched import LINES, Watched
from station.app.progress import duration_text

REFRESH_HZ = 4
"""Drawings a second: as many as one can read; each takes some 5 ms."""
_BAR = 40
_WIDTH = 78
_FRAME = 4
"""Columns of the panel's borders and of the room beside them."""


class PanelDisplay:
    """Shows the panel from `__enter__` to `__exit__`; its last state stays on the screen."""

    def __init__(self, console: Console, watched: Watched) -> None:
        self._watched = watched
        self._live = Live(
            console=console,
            get_renderable=lambda: rendered(watched.moment()),
            refresh_per_second=REFRESH_HZ,
            vertical_overflow="crop",  # a low terminal shows the upper part, and nothing scrolls
            redirect_stdout=False,
            redirect_stderr=False,
        )

    def __enter__(self) -> PanelDisplay:
        """Shows the panel."""
        self._live.start(refresh=True)
        return self

    def __exit__(self, *_: object) -> None:
        """Draws it a last time."""
        self._live.stop()

    def attach(self, bus: Bus) -> None:
        """Follows the session on this bus."""
        self._watched.attach(bus)

    def line(self, level: str, text: str) -> None:
        """Takes a line of the log."""
        self._watched.line(level, text)

    def tell(self, done: int) -> None:
        """Does nothing: the panel is drawn by itself."""

    def end(self, fault: str) -> None:
        """Does nothing: the summary follows."""


def rendered(moment: Moment) -> RenderableType:
    """Returns the panel of a moment: about 16 lines."""
    now = Table.grid(padding=(0, 2))
    for name, value in _now(moment):
        now.add_row(Text(name, style="dim"), value)
    health = Table.grid(padding=(0, 2))
    for part in moment.health:
        health.add_row(*_health(part))
    parts: list[RenderableType] = [now, Text(), _directions(moment.by_direction), Text(), health]
    if moment.lines:
        parts += [Text(), *(Text(row, style="dim") for row in _log(moment.lines))]
    return Panel(Group(*parts), title=_title(moment), title_align="left", width=_WIDTH)


def _log(lines: Sequence[str]) -> list[str]:
    """Returns the newest lines, broken between words, in as many rows as lines are kept.

    Only the newest is whole, however long it is.

    A remedy stands at the end of its sentence, and a low terminal has no further rows.
    """
    rows: list[str] = []
    for line in reversed(lines):
        broken = textwrap.wrap(line, _WIDTH - _FRAME, break_on_hyphens=False)
        if rows and len(rows) + len(broken) > LINES:
            break
        rows = [*broken, *rows]
    return rows


def _title(moment: Moment) -> str:
    paused = ", pausing" * moment.paused
    return f"run {moment.run}: {moment.phase}{paused}"


def _now(moment: Moment) -> list[tuple[str, RenderableType]]:
    left = "" if moment.left_s is None else f", about {duration_text(moment.left_s)} left"
    progress = Table.grid(padding=(0, 1))
    progress.add_row(
        ProgressBar(total=max(moment.total, 1), completed=moment.done, width=_BAR // 2),
        f"{moment.done} of {moment.total} in {duration_text(moment.passed_s)}{left}",
    )
    return [
        ("direction", Text(_direction(moment.direction, moment.azimuth_deg))),
        ("tilt", Text("–" if moment.tilt_deg is None else f"{moment.tilt_deg:6.2f}°")),
        ("block moved", _distance(moment)),
        ("samples", progress),
    ]


def _distance(moment: Moment) -> RenderableType:
    if moment.moved_px is None or moment.threshold_px is None:
        return Text("– (no reference)")
    row = Table.grid(padding=(0, 1))
    moved, threshold = moment.moved_px, moment.threshold_px
    bar = ProgressBar(total=threshold, completed=min(moved, threshold), width=_BAR // 2)
    row.add_row(bar, _distance_text(moment))
    return row


def _distance_text(moment: Moment) -> str:
    """Returns the distance in mm, or in px while the camera's geometry is unknown."""
    moved, threshold, unit = moment.moved_mm, moment.threshold_mm, "mm"
    if moved is None or threshold is None:
        moved, threshold, unit = moment.moved_px or 0.0, moment.threshold_px or 0.0, "px"
    if moved > threshold:
        return f"{moved:.1f} {unit}: a slip (beyond {threshold:.1f} {unit})"
    return f"{moved:.1f} of the {threshold:.1f} {unit} that make a slip"


def _directions(found: tuple[Direction, ...]) -> RenderableType:
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="dim")
    for name in ("direction", "slips", "mean °", "sd °"):
        table.add_column(name, justify="right")
    for one in found:
        cells = ("–" if value is None else f"{value:.2f}" for value in (one.mean_deg, one.sd_deg))
        table.add_row(_direction(one.direction, one.azimuth_deg), str(one.count), *cells)
    return table if found else Text("no slips yet", style="dim")


def _health(part: Health) -> tuple[RenderableType, RenderableType]:
    sign, style = ("–", "dim") if part.off else ("✓", "green") if part.well else ("!", "bold red")
    return Text(f"{sign} {part.part}", style=style), Text(part.text)


def _direction(number: int | None, azimuth_deg: float | None) -> str:
    """Returns a direction by its number, with the azimuth of the tilting axis where that is known."""
    name = "–" if number is None else "free" if number < 0 else str(number)
    return name if azimuth_deg is None else f"{name} ({azimuth_deg:.0f}°)"

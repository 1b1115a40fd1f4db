"""A session on a terminal: one panel that is drawn anew in its place."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from rich.console import Console, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from shared.bus import Bus
from station.app.display.barred import Barred
from station.app.display.fitted import GAP, INNER, Fitted, Part
from station.app.display.moment import Direction, Health, Moment
from station.app.display.watched import LINES, Watched
from station.app.progress import duration_text

REFRESH_HZ = 4
"""Drawings a second: as many as one can read; each takes some 5 ms."""
_NAMES = 11
"""Columns of the names before the values: "block moved" is the longest."""


class PanelDisplay:
    """Shows the panel from `__enter__` to `__exit__`; its last state stays on the screen."""

    def __init__(self, console: Console, watched: Watched) -> None:
        self._watched = watched
        self._live = Live(
            console=console,
            get_renderable=lambda: rendered(watched.moment()),
            refresh_per_second=REFRESH_HZ,
            vertical_overflow="crop",  # nothing scrolls; the panel itself has no more rows than the terminal
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


# The ranks of the rows where a terminal is low: the smaller, the longer a row stays. The phase stands in the title.
_FIRST, _HOW_FAR, _NEWEST, _HEALTH, _MEANS, _OLDER = range(6)


def rendered(moment: Moment) -> Fitted:
    """Returns the panel of a moment: about 16 rows, or as many as the terminal has."""
    now = [Part(rank, _named(Text(name, style="dim"), value)) for rank, name, value in _now(moment)]
    means = Part(_MEANS, _directions(moment.by_direction))
    health = [Part(_HEALTH if part.well else _FIRST, _named(*_health(part))) for part in moment.health]
    log = [GAP, *_log(moment.lines)] if moment.lines else []
    return Fitted(_title(moment), [*now, GAP, means, GAP, *health, *log])


def _named(name: Text, value: RenderableType) -> RenderableType:
    """Returns a row of a name and a value, the values of all rows below each other."""
    row = Table.grid(padding=(0, 2))
    row.add_column(width=_NAMES)
    row.add_column()
    row.add_row(name, value)
    return row


def _log(lines: Sequence[str]) -> list[Part]:
    """Returns the newest lines, broken between words, in as many rows as lines are kept.

    Only the newest is whole, however long it is: a remedy stands at the end of its sentence.
    """
    rows, parts = 0, list[Part]()
    for line in reversed(lines):
        rows += len(textwrap.wrap(line, INNER, break_on_hyphens=False))
        if parts and rows > LINES:
            break
        parts = [Part(_OLDER + len(parts) if parts else _NEWEST, Text(line, style="dim")), *parts]
    return parts


def _title(moment: Moment) -> str:
    paused = ", pausing" * moment.paused
    return f"run {moment.run}: {moment.phase}{paused}"


def _now(moment: Moment) -> list[tuple[int, str, RenderableType]]:
    """Returns the rows that change the most: rank, name and value."""
    tilt = Text("–" if moment.tilt_deg is None else f"{moment.tilt_deg:6.2f}°")
    return [
        (_FIRST, "direction", Text(_direction(moment.direction, moment.azimuth_deg))),
        (_FIRST, "tilt", tilt),
        (_HOW_FAR, "block moved", _distance(moment)),
        (_HOW_FAR, "samples", _progress(moment)),
    ]


def _progress(moment: Moment) -> RenderableType:
    left = "" if moment.left_s is None else f", about {duration_text(moment.left_s)} left"
    words = f"{moment.done} of {moment.total} in {duration_text(moment.passed_s)}{left}"
    return Barred(max(moment.total, 1), moment.done, words)


def _distance(moment: Moment) -> RenderableType:
    if moment.moved_px is None or moment.threshold_px is None:
        return Text("– (no reference)")
    return Barred(moment.threshold_px, moment.moved_px, _distance_text(moment))


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
    for name in ("direction", "kept samples", "mean °", "sd °"):
        table.add_column(name, justify="right")
    for one in found:
        cells = ("–" if value is None else f"{value:.2f}" for value in (one.mean_deg, one.sd_deg))
        table.add_row(_direction(one.direction, one.azimuth_deg), str(one.count), *cells)
    return table if found else Text("no kept samples yet", style="dim")


def _health(part: Health) -> tuple[Text, Text]:
    sign, style = ("–", "dim") if part.off else ("✓", "green") if part.well else ("!", "bold red")
    return Text(f"{sign} {part.part}", style=style), Text(part.text)


def _direction(number: int | None, azimuth_deg: float | None) -> str:
    """Returns a direction by its number, with the azimuth of the tilting axis where that is known."""
    name = "–" if number is None else "free" if number < 0 else str(number)
    return name if azimuth_deg is None else f"{name} ({azimuth_deg:.0f}°)"

"""The analysis of sessions: the results of each surface pair, and the words in which they are printed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from shared.errors import UserError
from shared.notes import note_line
from station.app.sessions import require_different
from station.friction.conclusions import conclusions
from station.friction.filters import CUTOUT_M, Opening
from station.friction.pairs import Session, pairs_of
from station.friction.report_tables import ReportTable, tables
from station.friction.results import PairResult, analyse, with_limit_curves


def results_of(sessions: Sequence[Session], *, cutout_m: float = CUTOUT_M, seed: int = 1) -> tuple[PairResult, ...]:
    """Returns the results of each surface pair; `cutout_m` is the radius of the opening in the foam.

    Raises:
        UserError: for a radius that is none, if there is no sample, or if samples come twice.
    """
    if not cutout_m > 0:
        raise UserError(f"Expected a positive radius of the opening in the foam, got {cutout_m * 1e3:g} mm")
    if not any(session.samples for session in sessions):
        listed = ", ".join(session.source for session in sessions)
        raise UserError(f"Expected samples in {listed}, but there is none: no run came to its end")
    require_different(sessions)
    rng = np.random.default_rng(seed)
    return with_limit_curves(analyse(pairs_of(sessions, opening=Opening(radius_m=cutout_m)), rng=rng), rng=rng)


def has_findings(results: Sequence[PairResult]) -> bool:
    """Returns true if something that was asked of the data cannot be concluded."""
    return any(note.finding for result in results for note in conclusions(result))


def in_words(results: Sequence[PairResult], sessions: Sequence[Session]) -> Iterator[RenderableType]:
    """Yields tables and conclusions, as the terminal shows them; notes and sessions without samples come first."""
    yield from (Text(note_line(note)) for note in notes_of(sessions))
    for session in sessions:
        if not session.samples:
            yield Text(f"{session.source} holds no samples: no run of that session came to its end.")
    for table in tables(results):
        yield printed(table)
    for result in results:
        yield Text(f"\n{result.pair.name}", style="bold")
        for note in conclusions(result):
            yield Text(f"{'!' if note.finding else '-'} {note.text}")


def notes_of(sessions: Sequence[Session]) -> tuple[str, ...]:
    """Notes on the sessions' rigs that the reader has to know, each once."""
    return tuple(dict.fromkeys(note for session in sessions for note in session.notes))


def printed(table: ReportTable) -> Table:
    """Returns a table for the terminal."""
    drawn = Table(title=table.title, title_justify="left", caption=table.note or None, caption_justify="left")
    for index, column in enumerate(table.columns):
        drawn.add_column(column, justify="right" if index else "left")
    for row in table.rows:
        drawn.add_row(*(Text(cell) for cell in row))
    return drawn

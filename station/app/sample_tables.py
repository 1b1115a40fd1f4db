"""A session's samples, and their mean by direction, as tables for the terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich.markup import escape
from rich.table import Table

from shared.messages import Sample
from shared.visible import visible
from station.recording.summary import by_direction, degrees, sd_degrees

ENDS = 10
"""Rows at each end of a long table: what fits on a screen together with the table by direction."""


def samples_table(samples: Sequence[Sample], *, ends: int = ENDS) -> Table:
    """Returns a row for each run, of many for the first and the last `ends`; angles are in degrees."""
    table = Table(title="Samples (angles in degrees)", title_justify="left")
    for column in ("run", "direction", "azimuth", "onset", "± sd", "step from", "step to", "dwell s"):
        table.add_column(column, justify="right")
    table.add_column("outcome")
    between = samples[ends:-ends] if len(samples) > 2 * ends else ()
    for sample in samples[:ends] if between else samples:
        table.add_row(*_row(sample))
    if between:
        table.add_row("…", *[""] * 7, f"{len(between)} more: station samples FILE --all")
        for sample in samples[-ends:]:
            table.add_row(*_row(sample))
    return table


def _row(sample: Sample) -> tuple[str, ...]:
    angles = [degrees(angle) for angle in (sample.azimuth_rad, sample.onset_angle_rad)]
    steps = [degrees(angle) for angle in (sample.step_from_rad, sample.step_to_rad)]
    measured = (*angles, sd_degrees(sample.onset_sigma_rad), *steps, f"{sample.dwell_s:.1f}")
    return str(sample.run), _direction(sample.direction), *measured, _outcome(sample)


def _outcome(sample: Sample) -> str:
    said = ["no slip up to this angle"] if sample.censored else []
    return escape(visible("; ".join([*said, *sample.flags]))) or "kept"


def directions_table(samples: Sequence[Sample]) -> Table:
    """Returns a row for each direction: counts, and mean and standard deviation of the kept samples' onsets."""
    table = Table(
        title="Onset angle by direction (kept samples)", title_justify="left",
        caption="Kept: neither censored nor flagged in the session. `station analyze` filters further.",
        caption_justify="left",
    )  # fmt: skip
    for column in ("direction", "kept", "censored", "flagged", "mean °", "sd °"):
        table.add_column(column, justify="right")
    for row in by_direction(samples):
        counts = (str(row.kept), str(row.censored), str(row.flagged))
        table.add_row(_direction(row.direction), *counts, degrees(row.mean_rad), degrees(row.sd_rad))
    return table


def _direction(direction: int) -> str:
    return "free" if direction < 0 else str(direction)

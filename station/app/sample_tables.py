"""A session's samples, and their mean by direction, as tables for the terminal."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rich.markup import escape
from rich.table import Table

from shared.messages import Sample
from station.recording.summary import by_direction


def samples_table(samples: Sequence[Sample]) -> Table:
    """A row for each run; angles are in degrees."""
    table = Table(title="Samples (angles in degrees)", title_justify="left")
    for column in ("run", "direction", "azimuth", "onset", "± sd", "step from", "step to", "dwell s"):
        table.add_column(column, justify="right")
    table.add_column("outcome")
    for sample in samples:
        angles = (sample.azimuth_rad, sample.onset_angle_rad, sample.onset_sigma_rad)
        steps = (sample.step_from_rad, sample.step_to_rad)
        cells = [_direction(sample.direction), *(_degrees(angle) for angle in (*angles, *steps))]
        table.add_row(str(sample.run), *cells, f"{sample.dwell_s:.1f}", _outcome(sample))
    return table


def _outcome(sample: Sample) -> str:
    said = ["no slip up to this angle"] if sample.censored else []
    return escape("; ".join([*said, *sample.flags])) or "kept"


def directions_table(samples: Sequence[Sample]) -> Table:
    """A row for each direction: counts, and mean and standard deviation of the kept runs' onsets."""
    table = Table(title="Onset angle by direction (kept runs)", title_justify="left")
    for column in ("direction", "kept", "censored", "flagged", "mean °", "sd °", "mean rad", "sd rad"):
        table.add_column(column, justify="right")
    for row in by_direction(samples):
        counts = (str(row.kept), str(row.censored), str(row.flagged))
        radians = [_or_dash(value, f"{value:.4f}") for value in (row.mean_rad, row.sd_rad)]
        table.add_row(_direction(row.direction), *counts, _degrees(row.mean_rad), _degrees(row.sd_rad), *radians)
    return table


def _direction(direction: int) -> str:
    return "free" if direction < 0 else str(direction)


def _degrees(angle_rad: float) -> str:
    return _or_dash(angle_rad, f"{math.degrees(angle_rad):.2f}")


def _or_dash(value: float, text: str) -> str:
    return "–" if math.isnan(value) else text

"""Reads a table of friction measurements: the columns of `Sample`, and those of tribometers and of other rigs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np

from shared.errors import UserError
from station.recording.cells import numbers_of
from station.recording.likely_friction import refuse_unlikely_friction
from station.recording.tables import LENGTHS, REQUIRED, known_columns, samples_in, table_of
from station.signals.measured import Column, Measured

COEFFICIENT, FORCE, LOAD = "friction_coefficient", "friction_force_n", "normal_load_n"
RECORD, TIME = "displacement_m", "time_s"
"""The columns of a continuous record, which is averaged in windows of equal slip."""

NUMBERS: Mapping[str, float] = MappingProxyType(
    {
        COEFFICIENT: 0.0,
        "friction_coefficient_sd": 0.0,
        FORCE: 0.0,
        LOAD: 0.0,
        "sliding_speed_m_s": 0.0,
        TIME: -math.inf,
        RECORD: -math.inf,
        "foam_free_m": -math.inf,
    }
)
"""The columns of numbers beside those of a sample, each with the smallest number that it may hold."""

GROUPS = ("group", "sequence", "day", "specimen")
"""The columns that name a group; rows are of one group if they agree in all of them."""

MOST_ROWS = 60_000
"""The largest number of measurements: a diagnosis takes 265 MB and 10.5 kB for each (ROW_BYTES in
station/diagnosis/observations/table_size.py has the measurements), 895 MB, and all of it is to stay below 1 GB."""

ALIKE, STEEPEST_RAD = 0.05, 1.5
"""Two ways to tell a row's friction agree to this share: a tilt of 10° that is rounded to whole degrees has its tangent
off by so much, and a steeper one by less. The other is the steepest tilt whose tangent is asked for, rad."""

ONE_OF = (REQUIRED, COEFFICIENT, FORCE)
"""A table must have one of these columns."""


def read_measured(path: Path) -> Measured:
    """Reads the rows of a table (.csv, .parquet).

    Raises:
        UserError: if the file is missing, of another kind, lacks what friction is read from, or holds something that is
            no number or mostly in another unit.
    """
    columns = table_of(path, one_of=ONE_OF)
    samples = samples_in(columns, path)
    if len(samples) > MOST_ROWS:
        every = -(-len(samples) // MOST_ROWS)
        mend = (
            f"keep one row of {every}, as its means are taken anyway"
            if {RECORD, TIME} <= set(columns)
            else "split the table"
        )
        raise UserError(f"Expected at most {MOST_ROWS} measurements in {path}, it holds {len(samples)}; {mend}")
    more = {
        name: numbers_of(columns[name], name, path, least=least) for name, least in NUMBERS.items() if name in columns
    }
    _require_load(more, path)
    onset_rad = np.array([sample.onset_angle_rad for sample in samples], dtype=np.float64)
    refuse_unlikely_friction(onset_rad, more.get(COEFFICIENT, np.zeros(0)), path)
    _require_one_friction(onset_rad, more, path)
    named = [columns[name] for name in GROUPS if name in columns]
    known = {*known_columns(), *NUMBERS, *GROUPS}
    return Measured(
        samples=samples,
        more=more,
        group=tuple(" ".join(str(cell) for cell in cells) for cells in zip(*named, strict=True)),
        ignored=tuple(name for name in columns if name not in known and not _numbered(name)),
    )


def _numbered(name: str) -> bool:
    """Returns true for a column of a vector, such as euler_rad_0."""
    vector, _, number = name.rpartition("_")
    return vector in LENGTHS and number.isdigit()


def _require_one_friction(onset_rad: Column, more: Mapping[str, Column], path: Path) -> None:
    """Refuses a table in which most tilts say another friction at rest than the rows' coefficients.

    The tilts would be left alone in silence.
    """
    none = np.full(len(onset_rad), np.nan)
    tilted, coefficient = np.tan(np.clip(onset_rad, 0.0, STEEPEST_RAD)), more.get(COEFFICIENT, none)
    at_rest = ~(more.get("sliding_speed_m_s", none) > 0.0)
    both = at_rest & (coefficient > 0.0) & (tilted > 0.0)
    other = np.flatnonzero(both & (np.abs(tilted - coefficient) > ALIKE * coefficient))
    if len(other) > 0.5 * both.sum():
        row = int(other[0])
        raise UserError(
            f"{path}, row {row + 1}: expected one friction, got {coefficient[row]:.4g} in '{COEFFICIENT}' and "
            f"{tilted[row]:.4g} by the tilt in '{REQUIRED}'; leave one of the columns out"
        )


def _require_load(more: Mapping[str, Column], path: Path) -> None:
    """Refuses a force of friction that no load says how to read."""
    if FORCE in more and COEFFICIENT not in more and LOAD not in more:
        raise UserError(f"Expected a column '{LOAD}' beside '{FORCE}' in {path}, found none; add one of them")

"""Refuses columns whose numbers no bench has: slips of unit, with the unit that was probably meant."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from shared.errors import UserError
from shared.geometry import Array
from shared.likely import BLOCK_M, PLATE_M, TILT_RAD
from station.recording.importers.tracks.units import QUANTITIES, Column


@dataclass(frozen=True)
class Likely:
    """The most that a quantity is on any bench, why, and what it is on most, in its SI `unit`."""

    most: float
    why: str
    usual: float
    unit: str


_PLACE = Likely(PLATE_M[1], "no plate is larger", 0.045, "m")
_ANGLE = Likely(2.0 * math.pi, "that is a whole turn", 1.0, "rad")
_NOISE = Likely(BLOCK_M[1], "no block is larger", 1e-4, "m")

LIKELY: Mapping[str, Likely] = {
    "x": _PLACE,
    "y": _PLACE,
    "z": _PLACE,
    "tilt": Likely(TILT_RAD, "no plate is tilted beyond the vertical", 0.4, "rad"),
    "azimuth": _ANGLE,
    "plate_mount": _ANGLE,
    "yaw": _ANGLE,
    "sigma": _NOISE,
    "sigma_yaw": _ANGLE,
    "area": Likely(BLOCK_M[1] ** 2, "no block is larger", 1e-4, "m2"),
}
"""The most of each quantity that is asked. A block may turn on and on: of its yaw only each run's first is asked."""

ROUNDED = 1.001
"""The share by which rounding may exceed a whole turn or a right angle: 1.571 rad is one."""


def refuse_unlikely(found: Mapping[str, Column], numbers: Mapping[str, Array], path: Path) -> None:
    """Refuses a table of `numbers` (n,) by quantity if some are beyond all benches, or beyond what a plate can do.

    Raises:
        UserError: with the column, the farthest of its numbers, and the unit that was probably meant.
    """
    begins = np.unique(numbers["run"], return_index=True)[1]
    for quantity, likely in ((name, likely) for name, likely in LIKELY.items() if name in numbers):
        values = np.abs(numbers[quantity])[begins if quantity == "yaw" else slice(None)]
        if np.nan_to_num(values).max(initial=0.0) > ROUNDED * likely.most:
            row = int(np.nanargmax(values))
            _refuse(found[quantity], float(values[row]), int(begins[row]) if quantity == "yaw" else row, path)


def _refuse(column: Column, value: float, row: int, path: Path) -> None:
    likely = LIKELY[column.quantity]
    units = list(_meant(column, value))
    mend = f"; did you mean {column.quantity}_{units[0]}?" if units else ""
    raise UserError(
        f"{path}, row {row + 1}: expected at most {likely.most:.4g} {likely.unit} in '{column.name}', as {likely.why}, "
        f"got {value:.4g} {likely.unit}{mend}"
    )


def _meant(column: Column, value: float) -> Iterator[str]:
    """Yields the units in which the number would be likely, that nearest to what is usual first."""
    likely, units = LIKELY[column.quantity], QUANTITIES[column.quantity]
    read = {unit: value / column.factor * factor for unit, factor in units.items()}
    near = [unit for unit, size in read.items() if size <= ROUNDED * likely.most]
    yield from sorted(near, key=lambda unit: abs(math.log(read[unit] / likely.usual)))

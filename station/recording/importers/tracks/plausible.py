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
_COUNTED_ON = Likely(6.0 * math.pi, "that is three turns", math.pi, "rad")
_NOISE = Likely(BLOCK_M[1], "no block is larger", 1e-4, "m")

LIKELY: Mapping[str, Likely] = {
    "x": _PLACE,
    "y": _PLACE,
    "z": _PLACE,
    "tilt": Likely(TILT_RAD, "no plate is tilted beyond the vertical", 0.4, "rad"),
    "azimuth": _COUNTED_ON,
    "plate_mount": _COUNTED_ON,
    "yaw": _ANGLE,
    "sigma": _NOISE,
    "sigma_yaw": _ANGLE,
    "area": Likely(BLOCK_M[1] ** 2, "no block is larger", 1e-4, "m2"),
    "mass": Likely(1e3, "no bench tilts more", 0.05, "kg"),
    "relative_humidity": Likely(1.0, "it is a share of saturation and no per cent", 0.5, ""),
}
"""The most of each quantity that is asked. A block may turn on and on: of its yaw only each run's first is asked.
A direction of the plate may be counted on from turn to turn, or be unwrapped."""

POSITIVE, NOT_NEGATIVE = ("mass", "area"), ("sigma", "sigma_yaw", "dwell", "relative_humidity")
"""The quantities that are larger than 0, and those that are 0 or larger: a track may have no noise, a run no dwell."""

ROUNDED = 1.001
"""The share by which rounding may exceed a whole turn or a right angle: 1.571 rad is one."""

STEP_S = 2.0
"""The longest usual time between rows, s: slides last from tenths of seconds to minutes, and one of a minute would have
thirty rows."""

LASTS_S = (0.02, 1800.0)
"""The usual times that a run lasts, s: in 20 ms a block falls by 2 mm and slides by less, and a plate that turns by one
degree a minute, eight times as slowly as in tilt tests of rock, has reached 30 degrees after half an hour."""

USUAL_STEP_S = 0.01
"""The time between rows of most tracks, s."""


def refuse_unlikely(found: Mapping[str, Column], numbers: Mapping[str, Array], path: Path) -> None:
    """Refuses a table of `numbers` (n,) by quantity if some are beyond all benches, or beyond what a plate can do.

    Raises:
        UserError: with the column, the farthest of its numbers, and the unit that was probably meant.
    """
    _refuse_times(found["t"], numbers, path)
    begins = np.unique(numbers["run"], return_index=True)[1]
    for quantity, likely in ((name, likely) for name, likely in LIKELY.items() if name in numbers):
        values = np.abs(numbers[quantity])[begins if quantity == "yaw" else slice(None)]
        if np.nan_to_num(values).max(initial=0.0) > ROUNDED * likely.most:
            row = int(np.nanargmax(values))
            _refuse(found[quantity], float(values[row]), int(begins[row]) if quantity == "yaw" else row, path)
    for quantity in (name for name in (*POSITIVE, *NOT_NEGATIVE) if name in numbers):
        _refuse_sign(found[quantity], numbers[quantity], path)


def _refuse_sign(column: Column, values: Array, path: Path) -> None:
    """Refuses a quantity whose `values` (n,) have a sign that it never has."""
    positive = column.quantity in POSITIVE
    wrong = np.flatnonzero(values <= 0.0 if positive else values < 0.0)
    if len(wrong):
        expected = "a number above 0" if positive else "0 or more"
        raise UserError(
            f"{path}, row {int(wrong[0]) + 1}: expected {expected} in '{column.name}', or nothing where it is "
            f"not known, got {values[wrong[0]] / column.factor:.4g}"
        )


def _refuse_times(column: Column, numbers: Mapping[str, Array], path: Path) -> None:
    """Refuses times (n,) whose rows are too far apart, or whose runs last too long or not long enough, as most do."""
    known = np.flatnonzero(np.isfinite(numbers["t"]))
    order = known[np.lexsort((numbers["t"][known], numbers["run"][known]))]
    time_s, run = numbers["t"][order], numbers["run"][order]
    steps_s, of_run = np.diff(time_s)[run[1:] == run[:-1]], run[1:][run[1:] == run[:-1]]
    if not len(steps_s):
        return
    begins = np.unique(of_run, return_index=True)[1]
    step_s, lasts_s = float(np.median(steps_s)), float(np.median(np.add.reduceat(steps_s, begins)))
    expected = _unlikely_time(step_s, lasts_s)
    if expected:
        factors = {unit: factor / column.factor for unit, factor in QUANTITIES["t"].items()}
        near = [unit for unit, by in factors.items() if not _unlikely_time(by * step_s, by * lasts_s)]
        units = sorted(near, key=lambda unit: abs(math.log(factors[unit] * step_s / USUAL_STEP_S)))
        mend = f"; did you mean t_{units[0]}?" if units else ""
        raise UserError(f"{path}: expected {expected} by '{column.name}'{mend}")


def _unlikely_time(step_s: float, lasts_s: float) -> str:
    """Returns what was expected of the time between rows and of a run's, s, and what came; empty: it is likely."""
    if step_s > STEP_S:
        return f"rows at most {STEP_S:g} s apart, as blocks slide for seconds, got rows {step_s:.3g} s apart"
    if not LASTS_S[0] <= lasts_s <= LASTS_S[1]:
        why = "no plate takes longer to tilt" if lasts_s > LASTS_S[1] else "no block slides in less"
        return f"runs of {LASTS_S[0]:g} s to {LASTS_S[1]:g} s, as {why}, got runs of {lasts_s:.3g} s"
    return ""


def _refuse(column: Column, value: float, row: int, path: Path) -> None:
    likely = LIKELY[column.quantity]
    units = list(_meant(column, value))
    mend = f"; did you mean {column.quantity}_{units[0]}?" if units else ""
    raise UserError(
        f"{path}, row {row + 1}: expected at most {f'{likely.most:.4g} {likely.unit}'.strip()} in '{column.name}', as "
        f"{likely.why}, got {f'{value:.4g} {likely.unit}'.strip()}{mend}"
    )


def _meant(column: Column, value: float) -> Iterator[str]:
    """Yields the units in which the number would be likely, that nearest to what is usual first."""
    likely, units = LIKELY[column.quantity], QUANTITIES[column.quantity]
    read = {unit: value / column.factor * factor for unit, factor in units.items()}
    near = [unit for unit, size in read.items() if size <= ROUNDED * likely.most]
    yield from sorted(near, key=lambda unit: abs(math.log(read[unit] / likely.usual)))

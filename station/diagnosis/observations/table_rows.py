"""The usable rows of a table in an order of their own, with their friction, load, speed, group and time."""

from __future__ import annotations

import math
import zlib
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from station.diagnosis import thresholds
from station.diagnosis.observations.plate import Times
from station.physics.contact import GRAVITY_M_S2, Array, Bools
from station.signals.measured import Measured

Index = Times


@dataclass(frozen=True, eq=False, kw_only=True)
class TableRows:
    """Rows (n,) that tell of friction.

    `row` is the row's number in the table, `number` the index of its run in the order of the runs, 0 if unknown.
    `time_ns` is 0 if unknown. `group` numbers the groups, in which rows are alike; None without groups. `coefficient`
    is nan for a block on a tilted plate; `sigma` is its relative standard deviation, nan if unknown. What is unknown of
    `load_n`, `displacement_m` and `foam_free_m` (the distance from the foam) is nan; `speed_m_s` is 0 at rest.
    `settled` (n,) is the decadic logarithm of the slip since the speed changed, m; nan if it has not. `read` counts the
    rows that were usable, `lost` the others, and `copies` those that repeat a row of the same run or time in all cells.
    """

    samples: NDArray[Any]
    row: Index
    number: Array
    time_ns: Times
    group: Index | None
    coefficient: Array
    sigma: Array
    load_n: Array
    speed_m_s: Array
    displacement_m: Array
    foam_free_m: Array
    settled: Array
    read: int
    lost: int
    copies: int = 0

    @classmethod
    def of(cls, table: Measured) -> TableRows:
        """Returns the rows with a usable angle or coefficient.

        Their order is that of their runs and times. Where the table has none, a row's place says nothing, and a
        checksum of its cells takes its place: the same rows give the same answer however they are sorted.
        """
        samples = np.fromiter(table.samples, dtype=object, count=len(table))
        coefficient = _coefficient(table)
        angle = np.array([sample.onset_angle_rad for sample in samples], dtype=np.float64)
        speed = np.nan_to_num(table.column("sliding_speed_m_s"))
        tilted = ~np.isfinite(coefficient) & (angle > thresholds.LEAST_TILT_RAD) & (angle < math.pi / 2)
        steady = tilted & (speed > 0)  # a block that slides on at this angle
        coefficient, tilted = np.where(steady, np.tan(angle), coefficient), tilted & ~steady
        run = np.array([sample.run for sample in samples], dtype=np.int64)
        time_ns = _time_ns(table)
        usable = tilted | (coefficient > 0)
        if tilted.any():  # a plate's onsets and coefficients at rest would be two channels of one name
            usable &= tilted | (speed > 0)
        indices, cells = np.flatnonzero(usable), _checksums(table)
        order = indices[np.lexsort((cells[indices], time_ns[indices], run[indices]))]
        group = _groups(table, order)
        kept = _first_of_copies(run[order], time_ns[order], cells[order], group)
        order, group = order[kept], None if group is None else group[kept]
        return cls(
            samples=samples[order],
            row=order + 1,
            number=_number(run[order], time_ns[order]),
            time_ns=time_ns[order],
            group=group,
            coefficient=coefficient[order],
            sigma=(table.column("friction_coefficient_sd") / coefficient)[order],
            load_n=_loads_n(table, steady)[order],
            speed_m_s=speed[order],
            displacement_m=table.column("displacement_m")[order],
            foam_free_m=table.column("foam_free_m")[order],
            settled=np.full(len(order), np.nan),
            read=len(order),
            lost=len(table) - len(indices),
            copies=len(indices) - len(order),
        )

    def __len__(self) -> int:
        return len(self.samples)

    def columns(self) -> dict[str, NDArray[Any]]:
        """Returns the fields that are arrays (n,), by name."""
        named = {one.name: getattr(self, one.name) for one in fields(self)}
        return {name: values for name, values in named.items() if isinstance(values, np.ndarray)}

    def chosen(self, indices: Index) -> TableRows:
        """Returns the rows with these indices."""
        return replace(self, **{name: values[indices] for name, values in self.columns().items()})

    def of_samples(self, name: str) -> Array:
        """Returns a field (n,) of the rows' samples."""
        return np.array([getattr(sample, name) for sample in self.samples], dtype=np.float64)

    def typical_first(self) -> TableRows:
        """Returns the rows of each group with those nearest to its median friction first.

        Whitening judges each row by those before it: an outlier that came first would make the others seem to be some.
        """
        if self.group is None:
            return self
        tilt = self.of_samples("onset_angle_rad")
        friction = np.log(np.where(self.pulled, self.coefficient, np.tan(tilt)))
        middle = np.array(
            [np.median(friction[self.group == one]) for one in range(int(self.group.max(initial=-1)) + 1)]
        )
        return self.chosen(np.lexsort((np.abs(friction - middle[self.group]), self.group)))

    @property
    def pulled(self) -> Bools:
        """True (n,) for rows with a coefficient, as of a tribometer."""
        return np.isfinite(self.coefficient)

    @property
    def ordered(self) -> bool:
        """True if the order of the runs is known."""
        return bool(np.ptp(self.number)) if len(self) else False

    @property
    def names(self) -> Index:
        """The rows' numbers (n,) for reports: their runs', or where these are no names those in the table."""
        runs = np.array([sample.run for sample in self.samples], dtype=np.int64)
        return runs if len(np.unique(runs)) == len(runs) else self.row


def _coefficient(table: Measured) -> Array:
    """Returns friction over load (n,), or the coefficient itself where the table has it; else nan."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = table.column("friction_force_n") / table.column("normal_load_n")
    given = table.column("friction_coefficient")
    found = np.where(np.isfinite(given), given, ratio)
    return np.where(np.isfinite(found) & (found > 0), found, np.nan)


def _loads_n(table: Measured, steady: Bools) -> Array:
    """Returns the normal loads (n,), N, also of blocks that slide steadily down a slope; nan where unknown."""
    noted = table.column("normal_load_n")
    weight = np.array([sample.block_mass_kg * math.cos(sample.onset_angle_rad) for sample in table.samples])
    pressed = np.where(steady & (weight > 0), GRAVITY_M_S2 * weight, np.nan)
    return np.where(np.isfinite(noted), noted, pressed)


def _time_ns(table: Measured) -> Times:
    """Returns the time (n,) of each row, ns; 0 where it is unknown."""
    noted = np.array([sample.slip_ns or sample.detect_ns for sample in table.samples], dtype=np.int64)
    seconds = table.column("time_s")
    return np.where(np.isfinite(seconds), np.round(np.nan_to_num(seconds) * 1e9).astype(np.int64), noted)


def _checksums(table: Measured) -> Index:
    cells = zip(table.samples, *table.more.values(), strict=True)
    return np.array([zlib.crc32(repr(cell).encode()) for cell in cells], dtype=np.int64)


def _first_of_copies(run: Index, time_ns: Times, cells: Index, group: Index | None) -> Index:
    """Returns the indices of rows (n,) without those that repeat an earlier one of the same run, time and group.

    Where these do not say which measurement a row is, two measurements may be equal, as of rounded numbers: there are
    no runs and times, or rows of one run and time that differ.
    """
    if not len(run) or not (np.ptp(run) or np.ptp(time_ns)):
        return np.arange(len(run))
    moments = np.column_stack([run, time_ns, np.zeros_like(run) if group is None else group])
    rows, first = np.unique(np.column_stack([moments, cells]), axis=0, return_index=True)
    several = len(np.unique(moments, axis=0)) < len(rows)
    return np.arange(len(run)) if several else np.sort(first)


def _number(run: Index, time_ns: Times) -> Array:
    """Returns the runs' numbers (n,) from 0 on; without any, the ranks of the times, and 0 without these."""
    known = run if len(run) and np.ptp(run) else np.unique(time_ns, return_inverse=True)[1]
    return np.asarray(known - known.min(initial=known[0] if len(known) else 0), dtype=np.float64)


def _groups(table: Measured, order: Index) -> Index | None:
    if not table.group:
        return None
    return np.unique(np.array(table.group)[order], return_inverse=True)[1].astype(np.int64)


def mass_of(load_n: Array, tilt_rad: Array | float = 0.0) -> Array:
    """Returns the mass (n,), kg, whose weight presses with `load_n` (n,), N, on a plate of that tilt."""
    return load_n / (GRAVITY_M_S2 * np.cos(tilt_rad))

"""Cuts a table of tracks into runs, and refuses times from which no motion can be read."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from shared.clock import SIMULATION_EPOCH_NS
from shared.errors import UserError
from shared.geometry import Array
from station.recording.importers.tracks.table import Tracks

Times = NDArray[np.int64]

SLOT_S = 100.0
"""Runs that have a clock each begin at multiples of this, or of the next power of ten that holds the longest. It must
not depend on a run's own length: a simulated run that is longer has to get the stamps of the recorded one."""

LEAST_RUNS = 2
"""The number of runs from which they can differ; a diagnosis wants more, and says so itself."""

LEAST_FRAMES = 12
"""A run has to have some frames more than the nine of one window; see `station.diagnosis.observations.windows`."""

LONGEST_S = 10_000.0
"""The longest time of a run that has a clock of its own."""

MOST_RUN = 100_000
"""The highest number of a run: the stamps of so many runs of 10 000 s each are still of this century."""

EVEN = 1.2
"""The intervals of two runs count as one rate up to this factor: clocks and jitter differ by less, and a track's noise
is read with one interval for all."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Run:
    """One run: its number, its rows (k,) in the table, and their stamps (k,), ns."""

    number: int
    rows: NDArray[np.int64]
    time_ns: Times

    def rest_of(self, first: int) -> Run:
        """Returns the run from its row `first` on."""
        return replace(self, rows=self.rows[first:], time_ns=self.time_ns[first:])


def runs_of(table: Tracks) -> tuple[Run, ...]:
    """Returns the runs in order of their beginning.

    Raises:
        UserError: for a run that has no whole number, too few rows, times that do not rise, or another rate.
    """
    number, t = table.numbers["run"], table.numbers["t"]
    _refuse_gaps(table)
    rows = [np.flatnonzero(number == one) for one in np.unique(number)]
    if len(rows) < LEAST_RUNS:
        raise UserError(
            f"Expected at least {LEAST_RUNS} runs in {table.source}, got one; what a difference is worth is judged by "
            "how much runs differ, so number each run in the column 'run'"
        )
    for own in rows:
        _refuse_unsorted(table, own)
    _refuse_mixed(table, rows)
    slot_s = _slot_s(t, rows)
    found = (
        Run(number=int(number[own[0]]), rows=own, time_ns=_stamps(t[own] + slot_s * number[own[0]])) for own in rows
    )
    return tuple(sorted(found, key=lambda run: int(run.time_ns[0])))


def has_one_clock(table: Tracks, runs: tuple[Run, ...]) -> bool:
    """Returns true if the runs follow each other on one clock, so that the time between them is known."""
    return _follow([table.numbers["t"][run.rows] for run in runs])


def _refuse_gaps(table: Tracks) -> None:
    number, t = table.numbers["run"], table.numbers["t"]
    for name, values in (("run", number), ("t_s", t)):
        if np.isnan(values).any():
            row = int(np.flatnonzero(np.isnan(values))[0]) + 1
            raise UserError(f"{table.source}, row {row}: expected a number for '{name}', got none")
    odd = np.flatnonzero((number != np.round(number)) | (number < 0) | (number > MOST_RUN))
    if len(odd):
        raise UserError(
            f"{table.source}, row {odd[0] + 1}: expected a whole number from 0 to {MOST_RUN} as 'run', "
            f"got {number[odd[0]]:g}"
        )
    if t.min() < 0:
        row = int(np.argmin(t))
        raise UserError(f"{table.source}, row {row + 1}: expected a time of at least 0 s, got {t[row]:g} s")


def _refuse_unsorted(table: Tracks, rows: NDArray[np.int64]) -> None:
    number, t = int(table.numbers["run"][rows[0]]), table.numbers["t"][rows]
    if len(rows) < LEAST_FRAMES:
        raise UserError(
            f"Expected at least {LEAST_FRAMES} rows of each run in {table.source}, got {len(rows)} of run {number}"
        )
    steps = np.diff(t)
    if (steps <= 0).any():
        row = int(np.flatnonzero(steps <= 0)[0]) + 1
        what = "twice" if steps[row - 1] == 0 else f"after {t[row - 1]:g} s"
        mend = "leave one of them out" if steps[row - 1] == 0 else "sort the rows by run and time"
        raise UserError(
            f"{table.source}, row {rows[row] + 1}: expected rising times in run {number}, "
            f"got {t[row]:g} s {what}; {mend}"
        )


def _refuse_mixed(table: Tracks, rows: list[NDArray[np.int64]]) -> None:
    steps = np.array([float(np.median(np.diff(table.numbers["t"][own]))) for own in rows])
    slow, fast = int(steps.argmax()), int(steps.argmin())
    if steps[slow] > EVEN * steps[fast]:
        rates = [f"{1 / steps[one]:.3g} Hz in run {table.numbers['run'][rows[one][0]]:.0f}" for one in (slow, fast)]
        raise UserError(
            f"Expected one rate in all runs of {table.source}, got {' and '.join(rates)}; "
            "resample them, or import them apart"
        )


def _follow(times: list[Array]) -> bool:
    begun = sorted(times, key=lambda own: float(own[0]))
    return len(times) > 1 and all(float(a[-1]) < float(b[0]) for a, b in pairwise(begun))


def _slot_s(t: Array, rows: list[NDArray[np.int64]]) -> float:
    """Returns the time between the beginnings of the runs' own clocks, s; 0 if they have one clock."""
    if _follow([t[own] for own in rows]):
        return 0.0
    longest = float(t.max())
    if longest > LONGEST_S:
        raise UserError(
            f"Expected runs that follow each other or begin near 0 s, got overlapping ones up to {longest:g} s"
        )
    return max(SLOT_S, 10.0 ** math.ceil(math.log10(max(longest, 1e-9) + 1e-9)))


def _stamps(seconds: Array) -> Times:
    return SIMULATION_EPOCH_NS + np.round(seconds * 1e9).astype(np.int64)


def each(table: Tracks, quantity: str, runs: tuple[Run, ...]) -> Iterator[float]:
    """Yields a quantity's value in each run; nan where it has none.

    Raises:
        UserError: if it changes within a run.
    """
    for run in runs:
        own = table.numbers[quantity][run.rows] if quantity in table else np.zeros(0)
        known = np.unique(own[np.isfinite(own)])
        if len(known) > 1:
            raise UserError(
                f"Expected one {quantity} in each run of {table.source}, "
                f"got {known[0]:g} and {known[1]:g} in run {run.number}"
            )
        yield float(known[0]) if len(known) else math.nan

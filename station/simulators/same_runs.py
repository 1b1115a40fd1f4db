"""Refuses a simulation of other commands than those that were recorded: other runs, frames or units."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from shared.errors import UserError
from station.signals.session import Signals
from station.simulators.recorded_runs import RecordedRun, recorded_runs

BESIDE_M, TURNED_RAD, TILTED_RAD = 5e-3, 0.2, math.radians(3.0)
"""A run is another one if the block lies farther away (half a block) or turned by more, or the plate tilts otherwise by
more (a tilt step): a simulation of the same commands begins where the block was seen, to a tenth of that
(tests/unit/app/test_given_input.py shows both sides)."""


def refuse_other_runs(recorded: Signals, simulated: Signals, *, name: str) -> None:
    """Raises a UserError if most runs that both have are not the same commands, or they have none in common."""
    mine, theirs = ({run.run: run for run in recorded_runs(each)} for each in (recorded, simulated))
    both = sorted(set(mine) & set(theirs))
    if not both:
        raise UserError(
            f"Expected a simulation of the recorded runs {_listed(mine)} in {name}, but it has the runs "
            f"{_listed(theirs)}"
        )
    apart = [
        (run, said)
        for run in both
        if (
            said := _difference(
                mine[run], theirs[run], *_steepest_of_both((recorded, mine[run]), (simulated, theirs[run]))
            )
        )
    ]
    if 2 * len(apart) > len(both):
        run, said = apart[0]
        raise UserError(
            f"Expected a simulation of the recorded commands in {name}, but {len(apart)} of {len(both)} runs are "
            f"others (run {run}: {said}); look at its runs, frames and units"
        )


def _difference(mine: RecordedRun, theirs: RecordedRun, tilt_rad: float, their_tilt_rad: float) -> str:
    """Returns the differences between both runs in words; empty: none."""
    away = float(np.hypot(*(theirs.start - mine.start)[:2]))
    if not away < BESIDE_M:
        return f"the block lies {1e3 * away:.3g} mm from where it was recorded"
    turned = abs(math.remainder(float(theirs.start[2] - mine.start[2]), 2.0 * math.pi))
    if not turned < TURNED_RAD:
        return f"the block is turned by {math.degrees(turned):.3g}° from how it was recorded"
    if not abs(their_tilt_rad - tilt_rad) < TILTED_RAD:
        return f"the plate tilts to {math.degrees(their_tilt_rad):.3g}°, recorded {math.degrees(tilt_rad):.3g}°"
    return ""


def _steepest_of_both(*sides: tuple[Signals, RecordedRun]) -> Iterator[float]:
    """Yields the steepest tilt of each, up to where the shorter ends.

    Some simulators stop as soon as the block slides.
    """
    lasted_ns = min(run.end_ns - run.begin_ns for _, run in sides)
    for signals, run in sides:
        tilts = signals.attitude.between(run.begin_ns, run.begin_ns + lasted_ns + 1).tilt_rad
        yield float(tilts.max(initial=0.0))


def _listed(runs: dict[int, RecordedRun]) -> str:
    listed = sorted(runs)
    return ", ".join(str(run) for run in listed[:8]) + (" …" if len(listed) > 8 else "") if listed else "(none)"

"""Batches of the runs of a session: those that are simulated at once, as many as fit into memory."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from shared.errors import UserError
from station.physics.contact import Array
from station.simulators.recorded_runs import RecordedRun

Integers = NDArray[np.int64]
KNOT_S = 0.01
MOST_KNOTS = 500_000
"""Attitudes of all runs of a batch, each run taken as long as its longest: five thousand seconds, in one run or many.
One takes 530 bytes, 750 with two effects on the attitude; a process of 130 MB then comes to 500 MB at most, whatever a
recording asks for (`pytest -m benchmark -s tests/benchmarks/test_simulated_memory.py` prints it)."""


def require_short(runs: Sequence[RecordedRun]) -> None:
    """Refuses runs whose attitudes do not fit into memory together, before any is made.

    Raises:
        UserError: if they do not.
    """
    longest = max(runs, key=lasts_s)
    if len(runs) * lasts_s(longest) > MOST_KNOTS * KNOT_S:
        raise UserError(
            f"Expected runs that last {MOST_KNOTS * KNOT_S / len(runs):.0f} s at most, to simulate {len(runs)} of them "
            f"at once, got run {longest.run} of {lasts_s(longest):.3g} s"
        )


def lasts_s(run: RecordedRun) -> float:
    """Returns the duration of what is repeated of a run, s."""
    return (run.end_ns - run.begin_ns) * 1e-9


def knots_s(run: RecordedRun) -> Array:
    """Returns times (k,) from 0 to the run's end, some 10 ms apart."""
    length = lasts_s(run)
    return np.linspace(0.0, length, max(2, round(length / KNOT_S) + 1))


def batches(runs: Sequence[RecordedRun], moments: Integers) -> Iterator[slice]:
    """Yields the slices of consecutive runs (n,) that are simulated at once.

    Args:
        runs: in order.
        moments: (n,) how many moments of each run are asked for. They are padded as the attitudes are, to as many as
            the run with the most has; a run with more than a batch may have is a batch of its own.
    """
    begin, widest = 0, 0.0
    for number, (run, asked) in enumerate(zip(runs, moments.tolist(), strict=True)):
        wide = max(lasts_s(run) / KNOT_S, asked)
        widest = max(widest, wide)
        if number > begin and (number + 1 - begin) * widest > MOST_KNOTS:
            yield slice(begin, number)
            begin, widest = number, wide
    yield slice(begin, len(runs))

"""The clocks that drive processes: the system's, or a simulated one."""

from __future__ import annotations

import time
from typing import Protocol


class Clock(Protocol):
    """Tells the time in nanoseconds since the epoch."""

    def now_ns(self) -> int:
        """Returns nanoseconds since the epoch."""
        ...


LOOKS = 9


def _epoch_ns() -> int:
    """Returns the time at which the monotonic clock was 0.

    Of several tries, the quickest one counts, which was least interrupted.
    """
    looks: list[tuple[int, int]] = []
    for _ in range(LOOKS):
        before, now, after = time.perf_counter_ns(), time.time_ns(), time.perf_counter_ns()
        looks.append((after - before, now - (before + after) // 2))
    return min(looks)[1]


class SystemClock:
    """The system's time at the start, carried on by the monotonic clock, so that it never steps back.

    `perf_counter_ns` is that clock on Linux and macOS. On Windows `monotonic_ns` moves in steps of 16 ms before Python
    3.13 (GetTickCount64), longer than the 11 ms between two frames.
    """

    def __init__(self) -> None:
        self._epoch_ns = _epoch_ns()

    def now_ns(self) -> int:
        """Returns nanoseconds since the epoch."""
        return self._epoch_ns + time.perf_counter_ns()

    def from_monotonic_ns(self, monotonic_ns: int) -> int:
        """Returns the time on this clock of a CLOCK_MONOTONIC stamp, which camera sensors give."""
        return self._epoch_ns + monotonic_ns


SIMULATION_EPOCH_NS = 1_600_000_000_000_000_000
"""The begin of simulated time (September 2020): a fixed date, so that the same seed gives the same bytes."""


class SimulatedClock:
    """A clock that moves only when it is told to."""

    def __init__(self, start_ns: int = SIMULATION_EPOCH_NS) -> None:
        self._now_ns = start_ns

    def now_ns(self) -> int:
        """Returns nanoseconds since the epoch."""
        return self._now_ns

    def advance_to(self, now_ns: int) -> None:
        """Moves on to `now_ns`; time never goes back, an earlier time is ignored."""
        self._now_ns = max(self._now_ns, now_ns)

"""A robot's clock, read off its joint states: they are stamped by it, and arrive by the agent's.

Arrival minus stamp is the offset between the two clocks plus the time on the way, which is never less than the way's
least. So the least of it over the latest states, added to a stamp, is the stamp by the agent's clock, late by the
least transport delay alone: neither the robot's clock nor the jitter of the network is in it.
"""

from __future__ import annotations

import time
from collections import deque

_STATES = 500
"""Two clocks that nobody keeps drift apart by 0.1 ms a second at most (crystals, 100 ppm): by 0.5 ms over as many
states at 100 Hz, and of so many some meet no queue on their way."""


class RobotClock:
    """Gives joint states' stamps by the clock of their arrivals, whatever the robot's own shows."""

    def __init__(self) -> None:
        self._gaps_ns: deque[int] = deque(maxlen=_STATES)
        self._stamp_ns = 0

    def offset_ns(self) -> int | None:
        """Returns this clock's time minus the robot's, and the least transport delay, ns; None while none is known."""
        return min(self._gaps_ns, default=None)

    def stamp_ns(self, robot_ns: int, *, arrived_ns: int) -> int:
        """Returns the time at which a joint state was taken, which never goes back.

        Args:
            robot_ns: the state's stamp, ns of the robot's clock; 0 where the robot sets none, and its arrival counts.
            arrived_ns: its arrival, ns of the clock that is asked for.
        """
        taken_ns = arrived_ns
        if robot_ns:
            self._gaps_ns.append(arrived_ns - robot_ns)
            taken_ns = robot_ns + min(self._gaps_ns)
        self._stamp_ns = max(self._stamp_ns, taken_ns)
        return self._stamp_ns


class Arrivals:
    """The monotonic clock, by which any thread notes an arrival, beside the agent's, which only a tick knows.

    The agent's is the monotonic one and a constant (`shared.clock.SystemClock`). A tick looks at both, at the agent's a
    little earlier, so that the largest difference is the best.
    """

    def __init__(self) -> None:
        self._ahead_ns: int | None = None

    @staticmethod
    def now() -> int:
        """Returns this moment, ns of the monotonic clock."""
        return time.perf_counter_ns()

    def tick(self, now_ns: int) -> None:
        """Takes in the agent's time of this moment."""
        ahead_ns = now_ns - self.now()
        self._ahead_ns = ahead_ns if self._ahead_ns is None else max(self._ahead_ns, ahead_ns)

    def ahead_ns(self) -> int:
        """Returns the agent's time minus that of the monotonic clock, ns; 0 before the first tick."""
        return self._ahead_ns or 0

"""Short horizons of a motion, for a robot that plays to its end whatever it has been told.

It is told no more than the next half second, behind which it is braked to rest, and is told anew before. So it rests
when nobody goes on: neither an arm agent that was killed nor a cut cable lets it run on to the motion's end.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from station.arm.stopping import resting
from station.arm.trajectory import JointTrajectory

HORIZON_NS = 500_000_000
"""The time that an agent may be silent before the arm brakes. The gate bears a silent arm as long (`silence_timeout_s`)
and the tilt stage a silent agent. Shorter ones would stop motions of an agent that is merely busy for a moment."""
RENEWAL_NS = 100_000_000
"""The time between two horizons: a fifth of one, so that three may come late. Each costs 0.6 ms, 0.6 % of a core."""


class Horizons:
    """The horizons of the motion under way, which the robot is to be told; times are ns of the agent's clock."""

    def __init__(self, max_acceleration_rad_s2: NDArray[np.float64]) -> None:
        """Takes the largest acceleration of each joint while it brakes, (n,), rad/s²."""
        self._limit = max_acceleration_rad_s2
        self._motion: JointTrajectory | None = None
        self._began_ns = self._told_ns = 0
        self._told: JointTrajectory | None = None

    def begin(self, motion: JointTrajectory, *, now_ns: int) -> JointTrajectory:
        """Begins a motion in place of the one under way, and returns its first horizon."""
        self._motion, self._began_ns = motion, now_ns
        return self._next(motion, now_ns)

    def renewed(self, now_ns: int) -> JointTrajectory | None:
        """Returns the next horizon once it is due, and None before, at rest, or where the last one reaches the end."""
        if self._motion is None or now_ns - self._told_ns < RENEWAL_NS or self.late_s(now_ns):
            return None
        return self._next(self._motion, now_ns)

    def late_s(self, now_ns: int) -> float:
        """Returns how long the robot was told nothing, s, once it has begun to brake for that; 0 before."""
        silent_ns = now_ns - self._told_ns
        return silent_ns * 1e-9 if self._motion is not None and silent_ns >= HORIZON_NS else 0.0

    def halted(self, now_ns: int) -> JointTrajectory | None:
        """Ends the motion; returns the way from where it is now to rest, and None where nothing moves."""
        self._motion = None
        elapsed_ns = now_ns - self._told_ns
        if self._told is None or elapsed_ns >= self._told.duration_ns:
            return None
        return self._tell(self._told, elapsed_ns, elapsed_ns, now_ns)

    def _next(self, motion: JointTrajectory, now_ns: int) -> JointTrajectory:
        elapsed_ns = now_ns - self._began_ns
        if elapsed_ns + HORIZON_NS >= motion.duration_ns:
            self._motion = None  # the horizon reaches its end, and there is no more to tell
        return self._tell(motion, elapsed_ns, elapsed_ns + HORIZON_NS, now_ns)

    def _tell(self, motion: JointTrajectory, from_ns: int, braking_ns: int, now_ns: int) -> JointTrajectory:
        limit = self._limit
        told = resting(motion, from_ns=from_ns, braking_ns=braking_ns, max_acceleration_rad_s2=limit)
        self._told, self._told_ns = told, now_ns
        return told

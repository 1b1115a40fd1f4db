"""Turns a stream of joint set-points into the velocities that the servos in the MuJoCo model are given.

In plain numbers: for six joints a sum in numpy takes longer than the whole command.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

FLOATS = NDArray[np.float64]
CATCH_UP_S = 0.02
"""Time constant with which a servo makes up for its difference from the set-point."""
STALE_NS = 50_000_000
"""The time for which a set-point is carried on at its velocity; without a newer one the joint then stops."""
SETTLED_RAD = 1e-6


class Servo:
    """The wanted motion of the joints, continued between set-points, so that their stairs do not shake the block."""

    def __init__(self, joint_start_rad: FLOATS, *, now_ns: int) -> None:
        self._target: tuple[FLOATS, FLOATS] | None = None
        self._position: list[float] = joint_start_rad.tolist()
        self._velocity = [0.0] * len(self._position)
        self.moving = False
        """True if the newest set-point moves on."""
        self._stamp_ns = now_ns
        self._wanted = self._wanted_before = self._velocity
        self.settled = False

    @property
    def jerk_rad_s(self) -> list[float]:
        """The change (n,), rad/s, of each joint's wanted velocity with the last command."""
        return [now - before for now, before in zip(self._wanted, self._wanted_before, strict=True)]

    def set_target(self, position_rad: FLOATS, velocity_rad_s: FLOATS, *, stamp_ns: int) -> None:
        """Wants the joints at `position_rad` at `stamp_ns`, moving on at `velocity_rad_s`; both (n,), and kept."""
        self._stamp_ns = stamp_ns
        target = self._target
        if target is not None and position_rad is target[0] and velocity_rad_s is target[1]:
            return
        self._target = position_rad, velocity_rad_s
        position, velocity = position_rad.tolist(), velocity_rad_s.tolist()
        moved, self.moving = self.moving, any(velocity)
        if not (moved or self.moving) and position == self._position:
            return
        self._position, self._velocity, self.settled = position, velocity, False

    def command(self, act_rad: Sequence[float], *, now_ns: int) -> list[float]:
        """Returns the servos' wanted velocities (rad/s) for the coming step, given their places `act_rad`."""
        catch_up = 1.0 / CATCH_UP_S
        if self.moving:
            # The way that is left, in the time to catch up, and the motion itself: one factor of the velocity.
            ahead_ns = now_ns - self._stamp_ns
            share = min(max(ahead_ns, 0), STALE_NS) * 1e-9 * catch_up + (1.0 if ahead_ns < STALE_NS else 0.0)
            rows = zip(self._position, act_rad, self._velocity, strict=True)
            wanted = [(goal - at) * catch_up + rate * share for goal, at, rate in rows]
        else:
            left = [goal - at for goal, at in zip(self._position, act_rad, strict=True)]
            self.settled = max(map(abs, left)) < SETTLED_RAD
            wanted = [0.0 if self.settled else way * catch_up for way in left]
        self._wanted_before, self._wanted = self._wanted, wanted
        return wanted

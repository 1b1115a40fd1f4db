"""From a stream of joint set-points to the velocities that the servos in the MuJoCo model are given."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FLOATS = NDArray[np.float64]
CATCH_UP_S = 0.02
"""Time constant with which a difference between set-point and servo is made up for."""
STALE_NS = 50_000_000
"""A set-point is carried on at its velocity for so long; when no newer one comes, the joint stops there."""
SETTLED_RAD = 1e-6


class Servo:
    """The wanted motion of the joints, continued between set-points, so that their stairs do not shake the block."""

    def __init__(self, joint_start_rad: FLOATS, *, now_ns: int) -> None:
        self._position = joint_start_rad.copy()
        self._velocity = np.zeros_like(joint_start_rad)
        self.moving = False
        """Whether the newest set-point moves on."""
        self._stamp_ns = now_ns
        self._wanted_velocity = self._velocity_before = np.zeros_like(joint_start_rad)
        self.settled = False

    @property
    def jerk_rad_s(self) -> FLOATS:
        """By how much the wanted velocity changed with the last command, (n,)."""
        return self._wanted_velocity - self._velocity_before

    def set_target(self, position_rad: FLOATS, velocity_rad_s: FLOATS, *, stamp_ns: int) -> None:
        """Wants the joints at `position_rad` at `stamp_ns`, moving on at `velocity_rad_s`; both (n,), and kept."""
        self._stamp_ns = stamp_ns
        if position_rad is self._position and velocity_rad_s is self._velocity:
            return
        moved, self.moving = self.moving, any(velocity_rad_s.tolist())
        if not (moved or self.moving) and position_rad.tolist() == self._position.tolist():
            return
        self._position, self._velocity = position_rad, velocity_rad_s
        self.settled = False

    def command(self, ctrl: FLOATS, act: FLOATS, *, now_ns: int) -> None:
        """Writes the servos' wanted velocities for the coming steps into `ctrl`, (n, 2), given their places `act`."""
        wanted = self._position - act
        if self.moving:
            # The way that is left, in the time to catch up, and the motion itself: one factor of the velocity.
            ahead_ns = now_ns - self._stamp_ns
            share = min(max(ahead_ns, 0), STALE_NS) * 1e-9 / CATCH_UP_S + (1.0 if ahead_ns < STALE_NS else 0.0)
            wanted /= CATCH_UP_S
            wanted += self._velocity * share
        else:
            self.settled = max(map(abs, wanted.tolist())) < SETTLED_RAD
            wanted *= 0.0 if self.settled else 1.0 / CATCH_UP_S
        self._velocity_before, self._wanted_velocity = self._wanted_velocity, wanted
        ctrl[:] = wanted[:, None]

"""The utilisation of a lying block: the share of its friction that it needs, from the plate's motion alone.

A block of mass m at rest on the plate needs the contact force m (a − g) with a the plate's acceleration under it. Its
share along the plate over its share across it, measured with the limit curve, is the utilisation: 1 is the onset.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from station.simulators.mujoco.poses import Bodies
from station.simulators.mujoco.specimen import FrictionDraw

FLOATS = NDArray[np.float64]
GRAVITY = 9.81
CREEP_M_S = 1e-3
"""A block slower than this on the plate feels nothing of its turning (below 0.001 m/s² at 20 degrees/s)."""
_LEVEL: FLOATS = np.array([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
Three = Sequence[float]


class PlateMotion:
    """The plate's motion in the last stretch of time, and what it demands of a block.

    The second difference of three poses is the acceleration at the middle one. The newest pose is therefore that of
    half a look after the stretch, whose middle is then the middle pose, and the acceleration lasts for the stretch:
    the path is a quadratic spline, as the arm's own readings are (`ArmEngine`). With the newest pose at the stretch's
    end a block feels its plate's acceleration 4 ms late (tests/recovery/test_time_of_paths.py); carried on by its slope
    it would be 3.5 times too large, as the joints do not move smoothly from step to step.
    """

    def __init__(self, *, ahead_s: float) -> None:
        """`ahead_s` is how much later than the stretch's end the poses are that it takes."""
        self._ahead_s = ahead_s
        self._newest = self._pose = _LEVEL
        """The newest pose, and that at the stretch's end: the rotation row by row, and the position."""
        self._rate = self._bend = self._bend_before = np.zeros(12)
        """The pose's first derivative at the stretch's end, its second in the stretch, and in the one before."""
        self._known, self._seconds = 0, 0.0

    def take(self, bodies: Bodies, *, seconds: float) -> None:
        """Takes the next stretch, `seconds` after the call before."""
        newest = np.concatenate((bodies.plate_rotation, bodies.plate_place))
        rate = (newest - (self._newest if self._known else newest)) / seconds
        if self._known > 1:
            self._bend_before, self._bend = self._bend, (rate - self._rate) / (0.5 * (seconds + self._seconds))
        self._newest, self._pose = newest, newest - self._ahead_s * rate
        self._rate, self._seconds = rate, seconds
        self._known += 1

    def needed(self, position: Three) -> tuple[float, float, float]:
        """Returns the contact force per mass (m/s², plate frame) that keeps a block at rest at `position`.

        It is the force at the stretch's end.
        """
        return _force(position, self._pose, self._bend)

    def pull(self, position: Three, velocity: Three, *, ago_s: float, step_s: float) -> tuple[float, float, float]:
        """Returns the acceleration (m/s², plate frame) of what nothing holds at `position`, that long before the end.

        It is gravity less the plate's own acceleration there, and Coriolis' acceleration of what moves at `velocity`.
        It stands for the `step_s` around its moment, of which some may lie in the stretch before.
        """
        earlier = min(max((ago_s - self._seconds) / step_s + 0.5, 0.0), 1.0)
        bend = self._bend + earlier * (self._bend_before - self._bend) if earlier else self._bend
        rate = self._rate - ago_s * self._bend
        pose = self._pose - 0.5 * ago_s * (self._rate + rate)
        fx, fy, fz = _force(position, pose, bend)
        vx, vy, vz = velocity
        if vx * vx + vy * vy < CREEP_M_S**2:
            return -fx, -fy, -fz
        wx, wy, wz = _spin(pose, rate)
        return -fx - 2 * (wy * vz - wz * vy), -fy - 2 * (wz * vx - wx * vz), -fz - 2 * (wx * vy - wy * vx)


def _force(position: Three, pose: FLOATS, bend: FLOATS) -> tuple[float, float, float]:
    """Returns gravity and the acceleration at a position (plate frame), for a pose with that second derivative."""
    (x, y, z), b, r = position, bend.tolist(), pose.tolist()
    ax = b[0] * x + b[1] * y + b[2] * z + b[9]
    ay = b[3] * x + b[4] * y + b[5] * z + b[10]
    az = b[6] * x + b[7] * y + b[8] * z + b[11] + GRAVITY
    return (
        r[0] * ax + r[3] * ay + r[6] * az,
        r[1] * ax + r[4] * ay + r[7] * az,
        r[2] * ax + r[5] * ay + r[8] * az,
    )


def _spin(pose: FLOATS, rate: FLOATS) -> tuple[float, float, float]:
    """Returns the plate's angular velocity (rad/s, plate frame), from its rotation and how that changes."""
    r, t = pose.tolist(), rate.tolist()
    return (
        r[2] * t[1] + r[5] * t[4] + r[8] * t[7],
        r[0] * t[2] + r[3] * t[5] + r[6] * t[8],
        r[1] * t[0] + r[4] * t[3] + r[7] * t[6],
    )


class Hold:
    """The hold of a block where it lies: by a limit curve in its direction, and by its width against toppling.

    `axis_rad` is where the axis of the limit curve points, in the plate frame.
    """

    def __init__(self, friction: FrictionDraw, *, axis_rad: float, block_yaw_rad: float) -> None:
        self._along, self._across = friction.mu_along, friction.mu_across
        self._weakest = min(friction.mu_along, friction.mu_across, 1.0)
        self._axis = math.cos(axis_rad), math.sin(axis_rad)
        self._side = math.cos(block_yaw_rad), math.sin(block_yaw_rad)

    def utilisation(self, force: Three) -> float:
        """Returns the share of its friction that a block needs under the contact force (plate frame).

        It is infinite without weight.

        A cube tips over an edge when the force leans by 45° across it; nearness to that counts in the same way, because
        a tipping block does not stick either.
        """
        x, y, normal = force
        if normal <= 0.05 * GRAVITY:
            return math.inf
        c, s = self._axis
        slip = math.hypot((c * x + s * y) / self._along, (c * y - s * x) / self._across)
        c, s = self._side
        tip = max(abs(c * x + s * y), abs(c * y - s * x))
        return max(slip, tip) / normal

    def slack(self, force: Three, *, share: float) -> float:
        """Gives the largest further acceleration (m/s²) in any direction that leaves the utilisation below `share`."""
        mu = share * self._weakest
        return (mu * force[2] - math.hypot(force[0], force[1])) / (1 + mu)

"""How much of its friction a lying block needs: the utilisation, from the plate's motion alone.

A block of mass m at rest on the plate needs the contact force m (a − g) with a the plate's acceleration under it. Its
share along the plate over its share across it, measured with the limit curve, is the utilisation: 1 is the onset.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from station.simulators.mujoco.specimen import FrictionDraw

GRAVITY = 9.81
Three = Sequence[float]


class PlateMotion:
    """The acceleration of the point under the block, from its positions at the ends of successive stretches of time."""

    def __init__(self) -> None:
        self._point: Three | None = None
        self._velocity: Three | None = None
        self._seconds = 0.0

    def forget(self) -> None:
        """Starts anew: the block is somewhere else on the plate."""
        self._point = self._velocity = None

    def acceleration(self, point: Three, *, seconds: float) -> tuple[float, float, float]:
        """The acceleration (m/s², world) now that the point is at `point`, `seconds` after the call before."""
        result = (0.0, 0.0, 0.0)
        if self._point is not None:
            p, q, v = self._point, point, self._velocity
            velocity = ((q[0] - p[0]) / seconds, (q[1] - p[1]) / seconds, (q[2] - p[2]) / seconds)
            if v is not None:
                mean = 0.5 * (seconds + self._seconds)
                result = ((velocity[0] - v[0]) / mean, (velocity[1] - v[1]) / mean, (velocity[2] - v[2]) / mean)
            self._velocity = velocity
        self._point, self._seconds = point, seconds
        return result


def needed(rotation: Three, acceleration: Three) -> tuple[float, float, float]:
    """Contact force per mass that keeps a block on the plate at rest, in the plate frame (m/s²).

    `rotation` is world_from_plate, row by row, (9,); `acceleration` is the plate's, in the world.
    """
    ax, ay, az = acceleration[0], acceleration[1], acceleration[2] + GRAVITY
    r = rotation
    return (
        r[0] * ax + r[3] * ay + r[6] * az,
        r[1] * ax + r[4] * ay + r[7] * az,
        r[2] * ax + r[5] * ay + r[8] * az,
    )


class Hold:
    """How a block is held where it lies: by a limit curve in its direction, and by its own width against tipping.

    `axis_rad` is where the axis of the limit curve points, in the plate frame.
    """

    def __init__(self, friction: FrictionDraw, *, axis_rad: float, block_yaw_rad: float) -> None:
        self._along, self._across = friction.mu_along, friction.mu_across
        self._weakest = min(friction.mu_along, friction.mu_across, 1.0)
        self._axis = math.cos(axis_rad), math.sin(axis_rad)
        self._side = math.cos(block_yaw_rad), math.sin(block_yaw_rad)

    def utilisation(self, force: Three) -> float:
        """Share of its friction that a block needs under the contact force (plate frame); infinite without weight.

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
        """Largest further acceleration (m/s²), in any direction, that leaves the utilisation below `share`."""
        mu = share * self._weakest
        return (mu * force[2] - math.hypot(force[0], force[1])) / (1 + mu)

"""The loads on a block by a plate that turns about another point than the configured pivot.

A block at r from the configured pivot feels the motion as −α × r − ω × (ω × r), and at r + a if the plate truly turns
about a point that lies −a from it. What a adds is linear in it, so that it is kept per metre (see `driving`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from station.diagnosis.observations.plate import Attitude
from station.physics.contact import GRAVITY_M_S2, Array
from station.physics.turning import turned_push

LEAST_M_S2 = 1e-3
"""A smaller pull or press has no ratio to another."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Swing:
    """Pull along `way` (2,) and press (2, m), m/s², of a run's `sliding` and `resting` block by the configured pivot.

    `per_m` (2, m, 3) is what each metre of the arm from true to configured pivot adds to both; `still_pull` (m,) is
    gravity's pull alone, and `plate_rad` (m,) the plate's tilt.
    """

    way: Array
    sliding: Array
    resting: Array
    per_m: Array
    still_pull: Array
    plate_rad: Array

    @classmethod
    def of(cls, at: Attitude, way: Array, *, sliding: Array, resting: Array) -> Swing:
        """Builds it from the plate's motion, the slide's direction, and the loads.

        Args:
            at: the plate's motion.
            way: (2,) the slide's direction in P, a unit vector.
            sliding: (m, 3) the loads of a sliding block in P, m/s².
            resting: (m, 3) the loads of a resting block in P, m/s².
        """
        turning = _felt_per_m(at)
        return cls(
            way=way,
            sliding=np.array([sliding[:, :2] @ way, -sliding[:, 2]]),
            resting=np.array([resting[:, :2] @ way, -resting[:, 2]]),
            per_m=np.array([np.einsum("i,mik->mk", way, turning[:, :2]), -turning[:, 2]]),
            still_pull=GRAVITY_M_S2 * (at.gravity[:, :2] @ way),
            plate_rad=at.tilt_rad,
        )

    def loads(self, arm_m: Array) -> Array:
        """Returns pull and press (2, m), m/s², of the sliding block with the arm `arm_m` (3,), m in P."""
        return self.sliding + self.per_m @ arm_m

    def tilt_rad(self, added: Array) -> Array:
        """Returns the tilts (m,) at which a plate at rest would load a resting block in the ratio that this one does.

        `added` (2, m) is what its pull and press, m/s², have beyond those of the configured pivot.
        """
        pull, press = self.resting + added
        pulled = np.abs(self.still_pull) > LEAST_M_S2
        share = pull / np.where(pulled, self.still_pull, LEAST_M_S2)
        level = np.maximum(press, LEAST_M_S2) / GRAVITY_M_S2
        return np.where(pulled, np.arctan2(np.sin(self.plate_rad) * share, level), self.plate_rad)


def _felt_per_m(at: Attitude) -> Array:
    """Returns the push (m, 3, 3), m/s², on a resting block along P's axes for each metre from the pivot, along each."""
    return np.stack([turned_push(at.acceleration_rad_s2, at.rate_rad_s, axis) for axis in np.eye(3)], axis=-1)

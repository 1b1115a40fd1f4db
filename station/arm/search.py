"""Searching for a home pose from which the plate can be tilted far in every direction (all candidates at once).

The base stands upright at the world's origin. A candidate is a place of the pivot (distance from the base's axis,
height), a turn of the plate about the vertical, and a branch of the inverse kinematics. Each is tilted in steps of
2.5 degrees at every azimuth, by Newton's method over all candidates together, until a limit ends it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from station.arm.kinematics import all_branches, follow, pivot_jacobian, solver, within_limits
from station.rig.arm_model import ArmModel, transform
from station.rig.tilt import tilt_rotation

Array = NDArray[np.float64]
_STEP_RAD = math.radians(2.5)
_EVERY = 3  # one of so many steps is looked at for what the arm touches there
_ARM_LENGTH_M = 0.4  # makes metres comparable with radians
_SINGULAR = 0.05  # least singular value: a wrist within some four degrees of being stretched has less
_SWING = 8.0  # rad of joint travel per rad of tilt over one step; more is the arm swinging round


@dataclass(frozen=True, kw_only=True)
class Candidates:
    """Home poses (k, n) with the pivot at `pivots_m` (k, 3) and the plate turned by `turns_rad` (k,) in the base frame.

    For the azimuths (a,): `reach_rad` (k, a); `ways_rad` (k, a, m, n), the joints at the tilts `looks_rad` (m,), or
    where they ended; `margin_rad` (k,), the least distance to a joint limit on the way; `travel` (k,), the most joint
    travel per tilt.
    """

    joints_rad: Array
    pivots_m: Array
    turns_rad: Array
    azimuths_rad: Array
    reach_rad: Array
    looks_rad: Array
    ways_rad: Array
    margin_rad: Array
    travel: Array

    def best(self, count: int) -> NDArray[np.int_]:
        """Returns indices (count,) of the best: by the reach in the worst azimuth, then by margin against travel."""
        worst = self.reach_rad.min(axis=1)
        comfort = np.minimum(self.margin_rad, 0.5) - 0.05 * self.travel
        return np.lexsort((-comfort, -np.round(worst, 6)))[:count]


def home_poses(
    model: ArmModel, *, distances_m: Array, heights_m: Array, turns_rad: Sequence[float]
) -> tuple[Array, Array, Array]:
    """Returns all level poses within limits on a grid.

    The grid is one over the pivot's place in the base frame and the turns of the plate about the vertical.

    Args:
        model: the arm.
        distances_m: (d,) the pivot's distances from the base's axis, m.
        heights_m: (h,) its heights, m.
        turns_rad: the turns of the plate about the vertical, rad.

    Returns:
        Joints (k, n), rad, pivots (k, 3), m, and turns (k,), rad.
    """
    arm = solver(model)
    joints: list[Array] = []
    pivots: list[tuple[float, float, float]] = []
    turns: list[float] = []
    for distance in distances_m.tolist():
        for height in heights_m.tolist():
            for turn in turns_rad:
                found = all_branches(model, transform((distance, 0.0, height), (0.0, 0.0, turn)), arm=arm)
                joints.extend(found)
                pivots.extend([(distance, 0.0, height)] * len(found))
                turns.extend([turn] * len(found))
    return np.array(joints).reshape(-1, len(model.joints)), np.array(pivots).reshape(-1, 3), np.array(turns)


def evaluate(
    model: ArmModel, poses: tuple[Array, Array, Array], *, azimuths_rad: Array, max_angle_rad: float
) -> Candidates:
    """Returns the reach of each of k poses, as `home_poses` has them, at each azimuth.

    The azimuths `azimuths_rad` (a,), rad, are measured in the plate's frame.
    """
    joints, pivots, turns = poses
    reach = np.zeros((len(joints), len(azimuths_rad)))
    margin = _margin(model, joints)
    travel = np.zeros(len(joints))
    angles: Array = np.arange(1.0, 1 + round(max_angle_rad / _STEP_RAD)) * _STEP_RAD
    ways = np.empty((*reach.shape, len(angles[_EVERY - 1 :: _EVERY]), len(model.joints)))
    for column, azimuth in enumerate(azimuths_rad):
        q, alive = joints.copy(), np.arange(len(joints))
        for number, angle in enumerate(angles, start=1):
            target = _targets(pivots[alive], turns[alive], tilt_rotation(float(angle), azimuth_rad=float(azimuth)))
            moved, error = follow(model, q[alive], target, iterations=3)
            slope = np.abs(moved - q[alive]).max(axis=-1) / _STEP_RAD
            good = (error < 1e-5) & within_limits(model, moved) & (slope < _SWING) & _regular(model, moved)
            alive, moved, slope = alive[good], moved[good], slope[good]
            q[alive], reach[alive, column] = moved, angle
            margin[alive] = np.minimum(margin[alive], _margin(model, moved))
            travel[alive] = np.maximum(travel[alive], slope)
            if number % _EVERY == 0:
                ways[:, column, number // _EVERY - 1] = q
    return Candidates(
        joints_rad=joints, pivots_m=pivots, turns_rad=turns, azimuths_rad=azimuths_rad,
        reach_rad=reach, looks_rad=angles[_EVERY - 1 :: _EVERY], ways_rad=ways, margin_rad=margin, travel=travel,
    )  # fmt: skip


def _regular(model: ArmModel, q: Array) -> NDArray[np.bool_]:
    """Returns true (k,) for joint poses (k, n) well away from singular ones, where the arm would swing round."""
    jacobian = pivot_jacobian(model, q)[1]
    jacobian[:, :3] /= _ARM_LENGTH_M
    return np.linalg.svd(jacobian, compute_uv=False)[:, -1] > _SINGULAR


def _margin(model: ArmModel, q: Array) -> Array:
    """Returns the distance to the nearest joint limit, (k,)."""
    return np.minimum(q - model.lower_rad, model.upper_rad - q).min(axis=-1)


def _targets(pivots_m: Array, turns_rad: Array, tilt: Array) -> Array:
    """Returns base_from_pivot (k, 4, 4) of plates turned about the vertical by (k,) then tilted in their own frame."""
    sine, cosine = np.sin(turns_rad), np.cos(turns_rad)
    turned = np.zeros((len(turns_rad), 4, 4))
    turned[:, 0, 0] = turned[:, 1, 1] = cosine
    turned[:, 1, 0], turned[:, 0, 1] = sine, -sine
    turned[:, 2, 2] = turned[:, 3, 3] = 1.0
    turned[:, :3, :3] = turned[:, :3, :3] @ tilt
    turned[:, :3, 3] = pivots_m
    return turned

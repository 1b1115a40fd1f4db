"""The joints' way through one tilt: from level to the steepest reachable angle at one azimuth, the pivot at rest.

The way is solved once, exactly, at knots of one degree, with its exact slope dq/dangle there; between the knots
it is a cubic Hermite curve (the pivot then strays by less than a micrometre). A tilt is thereafter a motion of one
number, the angle.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from shared.errors import UserError
from station.arm.kinematics import FULL, aimed, follow, pivot_jacobian, pivot_pose, pose_error, solve_rate
from station.rig.arm_model import ArmModel, transform
from station.rig.tilt import tilt_rotation, tilting_axis

Array = NDArray[np.float64]
MAX_ANGLE_RAD = math.radians(67.5)  # the paper's safe maximum
_KNOT_RAD = math.radians(1.0)
_SINGULAR = 20.0  # rad of joint travel per rad of tilt: beyond it the arm is swinging round, not tilting
_STRETCHED = "the arm is stretched out or at a singular pose"
_NO_AXIS = "no axis of the stage tilts further that way with the pivot at rest"
_HOME_TOLERANCE_RAD = 0.05


@dataclass(frozen=True, kw_only=True)
class TiltPath:
    """Joint angles as a function of the tilt angle, from 0 to `reach_rad`; `limit` says what ends it there.

    `angles_rad` (k,), `joints_rad` (k, n), `slopes` (k, n) = dq/dangle.
    """

    azimuth_rad: float
    angles_rad: Array
    joints_rad: Array
    slopes: Array
    limit: str

    @property
    def reach_rad(self) -> float:
        """The steepest reachable angle."""
        return float(self.angles_rad[-1])

    @cached_property
    def bends(self) -> Array:
        """The absolute second derivative of the joints by the angle at the knots, (k, n); needs two knots or more."""
        return np.abs(np.gradient(self.slopes, self.angles_rad, axis=0))

    def at(self, angles_rad: Array) -> tuple[Array, Array]:
        """Returns joint angles (m, n), rad, and dq/dangle (m, n) at `angles_rad` (m,), rad, clipped to the path."""
        x = np.minimum(np.maximum(angles_rad, 0.0), self.reach_rad)
        k = self.angles_rad.searchsorted(x, side="right") - 1
        k = np.minimum(np.maximum(k, 0), max(len(self.angles_rad) - 2, 0))
        if len(self.angles_rad) < 2:
            return np.repeat(self.joints_rad, len(x), axis=0), np.repeat(self.slopes, len(x), axis=0)
        h = (self.angles_rad[k + 1] - self.angles_rad[k])[:, None]
        u = (x - self.angles_rad[k])[:, None] / h
        q0, q1, m0, m1 = self.joints_rad[k], self.joints_rad[k + 1], self.slopes[k] * h, self.slopes[k + 1] * h
        chord = q1 - q0
        a, b = m0 + m1 - 2 * chord, 3 * chord - 2 * m0 - m1
        return q0 + u * (m0 + u * (b + u * a)), (m0 + u * (2 * b + 3 * u * a)) / h


@dataclass(frozen=True, kw_only=True)
class TiltStage:
    """An arm set up for tilting: `home_rad` holds the plate level, its axes along the world's, the pivot at `pivot_m`.

    `world_from_base` is (4, 4), `pivot_m` is (3,) in the world.
    """

    model: ArmModel
    world_from_base: Array
    home_rad: Array

    @cached_property
    def pivot_m(self) -> Array:
        """The centre of rotation in the world, (3,)."""
        return (self.world_from_base @ pivot_pose(self.model, self.home_rad))[:3, 3]

    def pivot_target(self, angle_rad: float, *, azimuth_rad: float) -> Array:
        """Returns base_from_pivot, (4, 4), of the tilted plate."""
        world_from_pivot = np.eye(4)
        world_from_pivot[:3, :3] = tilt_rotation(angle_rad, azimuth_rad=azimuth_rad)
        world_from_pivot[:3, 3] = self.pivot_m
        return self.base_from_world @ world_from_pivot

    @cached_property
    def base_from_world(self) -> Array:
        """The inverse of `world_from_base`, (4, 4)."""
        return np.asarray(np.linalg.inv(self.world_from_base), dtype=np.float64)


def tilt_stage(
    model: ArmModel, *, base_xyz_m: Sequence[float], base_yaw_rad: float, home_rad: Sequence[float] | Array
) -> TiltStage:
    """Sets up an arm whose base stands upright at `base_xyz_m` in the world, turned by `base_yaw_rad`.

    `home_rad` must hold the plate level and along the world's axes to 0.05 rad; what is left is corrected here.
    Raises UserError when it does not.
    """
    if len(home_rad) != len(model.joints):
        raise UserError(f"The home pose has {len(home_rad)} angles; {model.name} has {len(model.joints)} joints.")
    world_from_base = transform(base_xyz_m, (0.0, 0.0, base_yaw_rad))
    rough = TiltStage(model=model, world_from_base=world_from_base, home_rad=np.array(home_rad, dtype=np.float64))
    level = rough.pivot_target(0.0, azimuth_rad=0.0)
    home, _ = follow(model, rough.home_rad, level)
    error = float(np.linalg.norm(pose_error(pivot_pose(model, home), level)))
    moved = float(np.max(np.abs(home - rough.home_rad)))
    if error > 1e-9 or moved > _HOME_TOLERANCE_RAD:
        raise UserError(
            f"The home pose of {model.name} does not hold the plate level and along the world's axes (a joint is "
            f"{math.degrees(moved):.1f} degrees off): run `station arm plan` and copy the pose that it finds."
        )
    return TiltStage(model=model, world_from_base=world_from_base, home_rad=home)


def tilt_path(
    stage: TiltStage,
    *,
    azimuth_rad: float,
    max_angle_rad: float = MAX_ANGLE_RAD,
    touching: Callable[[Array], str] | None = None,
) -> TiltPath:
    """Follows one tilt from the home pose until a joint limit, a singular pose or `max_angle_rad` ends it.

    `touching` says what the arm would touch with its joints at (n,), or nothing; it ends the path, too.
    """
    angles = np.linspace(0.0, max_angle_rad, 1 + max(1, math.ceil(max_angle_rad / _KNOT_RAD)))
    targets = np.array([stage.pivot_target(float(angle), azimuth_rad=azimuth_rad) for angle in angles])
    twist = np.concatenate([np.zeros(3), stage.world_from_base[:3, :3].T @ tilting_axis(azimuth_rad)])
    rough = _trace(stage, targets, twist=twist, step_rad=float(angles[1]))
    joints, errors = follow(stage.model, rough, targets[: len(rough)], iterations=2)
    poses, jacobians = pivot_jacobian(stage.model, joints)
    slopes = solve_rate(jacobians, _twists(stage.model, poses, targets[: len(rough)], twist=twist))
    count, limit = 0, "the maximum asked for" if len(joints) == len(angles) else _STRETCHED
    for q, slope, error in zip(joints, slopes, errors, strict=True):
        if reason := _obstacle(stage.model, q, slope=slope, error=float(error)) or (touching(q) if touching else ""):
            limit = reason
            break
        count += 1
    if not count:
        raise UserError(f"The arm cannot stand level: {limit}.")
    return TiltPath(
        azimuth_rad=azimuth_rad,
        angles_rad=angles[:count],
        joints_rad=joints[:count],
        slopes=slopes[:count],
        limit=limit,
    )


def _trace(stage: TiltStage, targets: Array, *, twist: Array, step_rad: float) -> Array:
    """Returns joints (j, n) near the targets (k, 4, 4), one after the other.

    Each takes a Newton step and a step along the slope.

    It ends early, j < k, where the arm would swing round.
    """
    q = stage.home_rad
    joints: list[Array] = []
    for target in targets:
        pose, jacobian = pivot_jacobian(stage.model, q)
        here = _twists(stage.model, pose, target, twist=twist)
        correction, slope = solve_rate(jacobian, np.stack([pose_error(pose, aimed(stage.model, pose, target)), here]))
        if max(np.abs(correction).max(), np.abs(slope).max() * step_rad) > _SINGULAR * _KNOT_RAD:
            break
        q = q + correction
        joints.append(q)
        q = q + slope * step_rad
    return np.array(joints or [stage.home_rad])


def _twists(model: ArmModel, poses: Array, targets: Array, *, twist: Array) -> Array:
    """Returns the tilt's twist (6,) at poses (…, 4, 4), turned about the vertical as the arm's target is: (…, 6)."""
    turns = aimed(model, poses, targets)[..., :3, :3] @ np.swapaxes(targets[..., :3, :3], -1, -2)
    return np.concatenate([np.zeros((*turns.shape[:-2], 3)), turns @ twist[3:]], axis=-1)


def _obstacle(model: ArmModel, q: Array, *, slope: Array, error: float) -> str:
    """Returns the reason why the arm cannot take this pose; empty if it can."""
    if not error < 1e-7:
        return _STRETCHED if len(model.joints) >= FULL else _NO_AXIS
    if np.max(np.abs(slope)) > _SINGULAR:
        return "the arm is near a singular pose and would swing round"
    for joint, angle in zip(model.joints, q, strict=True):
        if joint.lower_rad is not None and angle < joint.lower_rad:
            return f"{joint.name} is at its lower limit of {math.degrees(joint.lower_rad):.0f} degrees"
        if joint.upper_rad is not None and angle > joint.upper_rad:
            return f"{joint.name} is at its upper limit of {math.degrees(joint.upper_rad):.0f} degrees"
    return ""

"""The joint angles that keep the pivot in place while the plate tilts.

All branches of a pose come from ssik (analytic, complete). Along a tilt the branch is followed by Newton's method on
the pose error, which keeps to it by construction and can be done for many poses at once: leading dimensions `...`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from shared.errors import UserError
from shared.installed import to_install
from shared.vectors import cross
from station.rig.arm_model import ArmModel, joint_transforms, link_transforms

if TYPE_CHECKING:
    from ssik import Manipulator

Array = NDArray[np.float64]
_TRIES = 8
FULL = 6
"""The number of joints from which on an arm can bring its plate into any pose."""


def pivot_pose(model: ArmModel, q: Array) -> Array:
    """Returns base_from_pivot, (…, 4, 4), for joint angles `q` (…, n), rad."""
    return link_transforms(model, q)[..., -1, :, :] @ model.last_from_flange @ model.flange_from_pivot


def pivot_jacobian(model: ArmModel, q: Array) -> tuple[Array, Array]:
    """Returns the pose of the pivot (…, 4, 4) and its Jacobian (…, 6, n) at joint angles `q` (…, n), rad.

    The Jacobian is linear over angular velocity, in the base frame.
    """
    links = link_transforms(model, q)
    pose = links[..., -1, :, :] @ model.last_from_flange @ model.flange_from_pivot
    axes = np.einsum("...nij,nj->...ni", links[..., :3, :3], np.array([joint.axis for joint in model.joints]))
    arms = pose[..., None, :3, 3] - links[..., :3, 3]
    return pose, np.moveaxis(np.concatenate([cross(axes, arms), axes], axis=-1), -1, -2)


def pose_error(pose: Array, target: Array) -> Array:
    """Returns the small twist (…, 6) from `pose` (…, 4, 4) to `target` (…, 4, 4): metres over radians, base frame.

    Both are base_from_pivot.
    """
    turn = target[..., :3, :3] @ np.swapaxes(pose[..., :3, :3], -1, -2)
    vee = np.stack([turn[..., 2, 1], turn[..., 0, 2], turn[..., 1, 0]], axis=-1)
    vee = vee - np.stack([turn[..., 1, 2], turn[..., 2, 0], turn[..., 0, 1]], axis=-1)
    return np.concatenate([target[..., :3, 3] - pose[..., :3, 3], vee / 2], axis=-1)


def follow(model: ArmModel, q: Array, target: Array, *, iterations: int = 4) -> tuple[Array, Array]:
    """Returns joint angles near `q` (…, n), rad, that bring the pivot to `target` (…, 4, 4), and the error left (…,).

    The target is base_from_pivot. Newton steps are shortened to 0.2 rad, so that a singular pose ends in an error and
    not in a leap. The error is the norm of the twist in metres and radians to the target as it is `aimed` at: above
    1e-9 the arm has left the poses that it can reach.
    """
    for _ in range(iterations):
        pose, jacobian = pivot_jacobian(model, q)
        step = solve_rate(jacobian, pose_error(pose, aimed(model, pose, target)))
        largest = np.max(np.abs(step), axis=-1, keepdims=True)
        q = q + step * np.minimum(1.0, 0.2 / np.maximum(largest, 1e-12))
    pose = pivot_pose(model, q)
    return q, np.linalg.norm(pose_error(pose, aimed(model, pose, target)), axis=-1)


def aimed(model: ArmModel, pose: Array, target: Array) -> Array:
    """Returns the `target` (…, 4, 4) of an arm at `pose` (…, 4, 4).

    A stage's is turned about the vertical as the pose is.

    Both are base_from_pivot. A stage of one or two axes cannot choose how its plate is turned about the vertical, the z
    of the base. Gravity in the plate, and with it the friction, does not depend on that.
    """
    if len(model.joints) >= FULL:
        return target
    turn = pose[..., :3, :3] @ np.swapaxes(target[..., :3, :3], -1, -2)
    angle = np.arctan2(turn[..., 1, 0] - turn[..., 0, 1], turn[..., 0, 0] + turn[..., 1, 1])
    result = np.broadcast_to(target, pose.shape).copy()
    result[..., :3, :3] = _about_z(angle) @ result[..., :3, :3]
    return result


def _about_z(angle: Array) -> Array:
    """Returns the turns about z (…, 3, 3) by angles (…,)."""
    result = np.zeros((*np.shape(angle), 3, 3))
    result[..., 0, 0] = result[..., 1, 1] = np.cos(angle)
    result[..., 1, 0] = np.sin(angle)
    result[..., 0, 1] = -result[..., 1, 0]
    result[..., 2, 2] = 1.0
    return result


def solve_rate(jacobian: Array, twist: Array) -> Array:
    """Returns joint rates (…, n) that give a twist, damped a little, so that it is finite at a singular pose.

    Fewer than six joints come as near to the twist as they can, with its turn about the vertical left out (`aimed`).

    Args:
        jacobian: (…, 6, n) that of `pivot_jacobian`.
        twist: (…, 6) metres over radians in the base frame: that of a step, which gives a step of the joints in rad, or
            its rate by anything, which gives the joints' rate by the same.
    """
    transposed = np.swapaxes(jacobian, -1, -2)
    if (joints := jacobian.shape[-1]) < FULL:
        turns, across = jacobian[..., : FULL - 1, :], transposed[..., : FULL - 1]
        damped = across @ turns + 1e-12 * np.eye(joints)
        return np.linalg.solve(damped, np.einsum("...ij,...j->...i", across, twist[..., : FULL - 1])[..., None])[..., 0]
    damped = jacobian @ transposed + 1e-12 * np.eye(6)
    return np.einsum("...ij,...j->...i", transposed, np.linalg.solve(damped, twist[..., None])[..., 0])


def within_limits(model: ArmModel, q: Array, *, margin_rad: float = 0.0) -> NDArray[np.bool_]:
    """Returns true (…,) if all joints `q` (…, n), rad, are inside their limits by at least the margin."""
    return np.all((q >= model.lower_rad + margin_rad) & (q <= model.upper_rad - margin_rad), axis=-1)


def arm_length_m(model: ArmModel) -> float:
    """Returns the length from the third joint's origin to the flange, along the links."""
    places = [joint.origin_xyz_m for joint in model.joints[2:]] + [model.flange_xyz_m]
    return sum(math.hypot(*place) for place in places)


def spherical(model: ArmModel) -> bool:
    """Returns true if the last three axes meet in one point, so that they turn the plate without moving their wrist."""
    pose = link_transforms(model, np.asarray(model.home_rad))[-3:]
    axes = [frame[:3, :3] @ joint.axis for frame, joint in zip(pose, model.joints[-3:], strict=True)]
    # Each line keeps what is across it of a point: the point that is nearest to all lines has to lie on them.
    across = np.concatenate([np.eye(3) - np.outer(axis, axis) for axis in axes])
    wanted = np.concatenate([keep @ frame[:3, 3] for keep, frame in zip(across.reshape(3, 3, 3), pose, strict=True)])
    nearest = np.linalg.lstsq(across, wanted)[0]
    return float(np.abs(across @ nearest - wanted).max()) < 1e-4


def solver(model: ArmModel) -> Manipulator:
    """Returns the analytic solver of this arm; without a catalogue entry a curved wrist takes minutes to prepare, once.

    Raises:
        UserError: if ssik is not installed; it has no wheel for Linux on arm64.
    """
    try:
        from ssik import Manipulator  # noqa: PLC0415 - only planning needs all branches; the agent starts without it
    except ModuleNotFoundError as missing:
        raise UserError(
            "Expected the package ssik, which finds all poses of an arm, but it is not installed; run: "
            f"{to_install('arm')} (on Linux arm64 it has no wheel), or plan on another machine and copy the pose "
            "into rig.toml"
        ) from missing

    if model.catalogue:
        return Manipulator.from_prebuilt(model.catalogue)
    joints = joint_transforms(model, np.zeros(len(model.joints)))
    return Manipulator.from_transforms(
        np.concatenate([joints, model.last_from_flange[None]]), np.array([joint.axis for joint in model.joints])
    )


def all_branches(model: ArmModel, base_from_pivot: Array, *, arm: Manipulator | None = None) -> Array:
    """Returns all joint poses (k, n), rad, that bring the pivot to `base_from_pivot` (4, 4), inside the limits.

    Each joint is within one turn: limited joints are brought as near to the middle of their range as whole turns do,
    endless ones into 0 to 2 pi. `arm` saves building the solver.
    """
    arm = arm or solver(model)
    pivot_from_flange = np.linalg.inv(model.flange_from_pivot)
    poses: list[Array] = []
    for nearby in _nearby(base_from_pivot, count=_TRIES if model.catalogue else 1):
        found = arm.solve(nearby @ pivot_from_flange, respect_limits=False, enumerate_windings=False)
        poses.extend(np.asarray(solution.q) for solution in found)
    candidates = np.array(poses).reshape(-1, len(model.joints))
    exact, error = follow(model, candidates, np.broadcast_to(base_from_pivot, (len(candidates), 4, 4)), iterations=5)
    exact = exact[error < 1e-9]
    limited = np.isfinite(model.lower_rad)
    middle = np.where(
        limited, (np.where(limited, model.lower_rad, 0) + np.where(limited, model.upper_rad, 0)) / 2, np.pi
    )
    exact = middle - np.pi + np.mod(exact - middle + np.pi, 2 * np.pi)
    return _distinct(exact[within_limits(model, exact)])


def _nearby(pose: Array, *, count: int) -> list[Array]:
    """Returns the pose itself and others within 2 mm of it.

    A catalogue's ready-made solver loses branches of a curved wrist (2 of 4 on average), other ones for each pose:
    several poses near by give them all, and Newton's method brings them to this one.
    """
    shifts = np.random.default_rng(0).uniform(-0.002, 0.002, (count, 3))
    shifts[0] = 0
    poses = np.repeat(pose[None], count, axis=0)
    poses[:, :3, 3] += shifts
    return list(poses)


def _distinct(poses: Array) -> Array:
    """Returns the poses (k, n) without repetitions (to a thousandth of a radian, full turns apart or not)."""
    kept: list[Array] = []
    for pose in poses:
        if not any(np.abs(np.mod(pose - other + np.pi, 2 * np.pi) - np.pi).max() < 1e-3 for other in kept):
            kept.append(pose)
    return np.array(kept).reshape(-1, poses.shape[-1])

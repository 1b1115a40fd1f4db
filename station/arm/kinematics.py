"""Where the joints must be for the pivot to stay put while the plate tilts.

All branches of a pose come from ssik (analytic, complete). Along a tilt the branch is followed by Newton's method on
the pose error, which keeps to it by construction and can be done for many poses at once: leading dimensions `...`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from station.rig.arm_model import ArmModel, joint_transforms, link_transforms

if TYPE_CHECKING:
    from ssik import Manipulator

Array = NDArray[np.float64]


def pivot_pose(model: ArmModel, q: Array) -> Array:
    """base_from_pivot, (..., 4, 4), for joint angles (..., n)."""
    return link_transforms(model, q)[..., -1, :, :] @ model.last_from_flange @ model.flange_from_pivot


def pivot_jacobian(model: ArmModel, q: Array) -> tuple[Array, Array]:
    """The pose of the pivot (..., 4, 4) and its Jacobian (..., 6, n): linear over angular velocity, base frame."""
    links = link_transforms(model, q)
    pose = links[..., -1, :, :] @ model.last_from_flange @ model.flange_from_pivot
    axes = np.einsum("...nij,nj->...ni", links[..., :3, :3], np.array([joint.axis for joint in model.joints]))
    arms = pose[..., None, :3, 3] - links[..., :3, 3]
    return pose, np.moveaxis(np.concatenate([np.cross(axes, arms), axes], axis=-1), -1, -2)


def pose_error(pose: Array, target: Array) -> Array:
    """The small twist (..., 6) from `pose` to `target`, (..., 4, 4): metres over radians, base frame."""
    turn = target[..., :3, :3] @ np.swapaxes(pose[..., :3, :3], -1, -2)
    vee = np.stack([turn[..., 2, 1], turn[..., 0, 2], turn[..., 1, 0]], axis=-1)
    vee = vee - np.stack([turn[..., 1, 2], turn[..., 2, 0], turn[..., 0, 1]], axis=-1)
    return np.concatenate([target[..., :3, 3] - pose[..., :3, 3], vee / 2], axis=-1)


def follow(model: ArmModel, q: Array, target: Array, *, iterations: int = 4) -> tuple[Array, Array]:
    """Joint angles near `q` (..., n) whose pivot is at `target` (..., 4, 4), and the error left (...,).

    Newton steps are shortened to 0.2 rad, so that a singular pose ends in an error and not in a leap. The error is the
    norm of the twist in metres and radians: a caller that finds it above 1e-9 has left the reachable poses.
    """
    for _ in range(iterations):
        pose, jacobian = pivot_jacobian(model, q)
        step = solve_rate(jacobian, pose_error(pose, target))
        largest = np.max(np.abs(step), axis=-1, keepdims=True)
        q = q + step * np.minimum(1.0, 0.2 / np.maximum(largest, 1e-12))
    return q, np.linalg.norm(pose_error(pivot_pose(model, q), target), axis=-1)


def solve_rate(jacobian: Array, twist: Array) -> Array:
    """Joint rates (..., n) that give the twist (..., 6), damped a little, so that it is finite at a singular pose."""
    transposed = np.swapaxes(jacobian, -1, -2)
    damped = jacobian @ transposed + 1e-12 * np.eye(6)
    return np.einsum("...ij,...j->...i", transposed, np.linalg.solve(damped, twist[..., None])[..., 0])


def within_limits(model: ArmModel, q: Array, *, margin_rad: float = 0.0) -> NDArray[np.bool_]:
    """Whether all joints (..., n) are inside their limits by at least the margin, (...,)."""
    return np.all((q >= model.lower_rad + margin_rad) & (q <= model.upper_rad - margin_rad), axis=-1)


def solver(model: ArmModel) -> Manipulator:
    """The analytic solver of this arm; building it is cheap for a spherical wrist, minutes (once) for a curved one."""
    from ssik import Manipulator  # noqa: PLC0415 - only planning needs all branches; the agent starts without it

    joints = joint_transforms(model, np.zeros(len(model.joints)))
    return Manipulator.from_transforms(
        np.concatenate([joints, model.last_from_flange[None]]), np.array([joint.axis for joint in model.joints])
    )


def all_branches(model: ArmModel, base_from_pivot: Array, *, arm: Manipulator | None = None) -> Array:
    """All joint poses (k, n) that bring the pivot to a pose (4, 4), inside the limits, each joint within one turn.

    Limited joints are brought into their own range, endless ones into 0 to 2 pi. `arm` saves building the solver.
    """
    target = base_from_pivot @ np.linalg.inv(model.flange_from_pivot)
    found = (arm or solver(model)).solve(target, respect_limits=False, enumerate_windings=False)
    poses = np.array([np.asarray(solution.q) for solution in found]).reshape(-1, len(model.joints))
    lowest = np.where(np.isfinite(model.lower_rad), model.lower_rad, 0.0)
    poses = lowest + np.mod(poses - lowest, 2 * np.pi)
    return poses[within_limits(model, poses)]

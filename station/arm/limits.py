"""The limits of a trajectory: every sample, and every moment between two samples, must be inside the arm's limits.

A driver plays the cubic Hermite curve through the samples, so the curve is what is checked: its velocity has its
extremes at the samples or at one vertex a piece, its acceleration at the ends of the pieces.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from station.arm.kinematics import pivot_pose
from station.arm.tilt_path import TiltStage
from station.arm.trajectory import JointTrajectory
from station.rig.arm_model import ArmModel
from station.rig.arm_settings import GateSettings

Array = NDArray[np.float64]
_LONGEST_GAP_NS = 100_000_000
_LONGEST_NS = 600_000_000_000
_ABSURD = 100.0  # also for endless joints: 16 turns away is a mistake, and keeps the sums below finite
_SLACK = 1.0 + 1e-6


def trajectory_fault(trajectory: JointTrajectory, *, stage: TiltStage, settings: GateSettings) -> str:
    """Returns the reason why the trajectory may not be played, in one sentence; empty when it may."""
    return (
        _shape_fault(trajectory, joints=len(stage.model.joints))
        or _position_fault(trajectory, model=stage.model, settings=settings)
        or _motion_fault(trajectory, model=stage.model, settings=settings)
        or _workspace_fault(trajectory, stage=stage, settings=settings)
    )


def _shape_fault(trajectory: JointTrajectory, *, joints: int) -> str:
    count = len(trajectory.times_ns) if trajectory.times_ns.ndim == 1 else 0
    if count < 2:
        return "the trajectory has fewer than two samples"
    for values in (trajectory.position_rad, trajectory.velocity_rad_s):
        if values.shape != (count, joints):
            return f"the trajectory has the shape {values.shape}, expected {count} samples of {joints} joints"
        if not (np.abs(values) <= _ABSURD).all():
            return f"the trajectory holds a number that is not finite, or beyond {_ABSURD:.0f} rad"
    return _time_fault(trajectory.times_ns.tolist())


def _time_fault(times_ns: list[int]) -> str:
    gaps = [later - earlier for earlier, later in itertools.pairwise(times_ns)]
    if times_ns[0] != 0 or min(gaps) <= 0:
        return "the trajectory's times do not run forward from zero"
    if max(gaps) > _LONGEST_GAP_NS or times_ns[-1] > _LONGEST_NS:
        return "the trajectory's samples are more than 0.1 s apart, or it lasts longer than 10 minutes"
    return ""


def _position_fault(trajectory: JointTrajectory, *, model: ArmModel, settings: GateSettings) -> str:
    position = trajectory.position_rad
    outside = (position < model.lower_rad) | (position > model.upper_rad)
    if outside.any():
        sample, joint = (int(index) for index in np.argwhere(outside)[0])
        angle = math.degrees(position[sample, joint])
        return f"{model.joints[joint].name} at {angle:.1f} degrees is outside its limits of {_range(model, joint)}"
    travel = position.max(axis=0) - position.min(axis=0)
    joint = int(travel.argmax())
    if travel[joint] > math.radians(settings.max_joint_step_deg):
        return (
            f"{model.joints[joint].name} would turn by {math.degrees(travel[joint]):.0f} degrees in one motion "
            f"(at most {settings.max_joint_step_deg:.0f})"
        )
    return ""


def _motion_fault(trajectory: JointTrajectory, *, model: ArmModel, settings: GateSettings) -> str:
    speed, acceleration = extremes(trajectory)
    for what, unit, found, limit in (
        ("speed", "degrees/s", speed, model.max_velocity_rad_s * settings.velocity_share),
        ("acceleration", "degrees/s²", acceleration, model.max_acceleration_rad_s2 * settings.acceleration_share),
    ):
        joint = int((found / limit).argmax())
        if not found[joint] <= limit[joint] * _SLACK:
            return (
                f"{model.joints[joint].name} would reach a {what} of {math.degrees(found[joint]):.1f} {unit}, "
                f"its limit is {math.degrees(limit[joint]):.1f}"
            )
    if np.abs(trajectory.velocity_rad_s[-1]).max() > 1e-6:
        return "the trajectory does not end at rest"
    return ""


def extremes(trajectory: JointTrajectory) -> tuple[Array, Array]:
    """Returns the largest speed and acceleration of each joint, (n,) and (n,), over the whole interpolated motion.

    The speed in a piece is a parabola: with the velocities v0, v1 at its ends and the mean velocity c it is the Bezier
    curve of v0, m = 3 c - v0 - v1 and v1, within which it stays where m is no extreme.
    """
    h = np.diff(trajectory.times_ns)[:, None] * 1e-9
    velocity = trajectory.velocity_rad_s
    first, last = velocity[:-1], velocity[1:]
    middle = 3 * np.diff(trajectory.position_rad, axis=0) / h - first - last
    rise, fall = middle - first, last - middle
    speed = np.maximum(np.abs(velocity).max(axis=0), _vertices(first, rise, fall).max(axis=0))
    return speed, (2 * np.maximum(np.abs(rise), np.abs(fall)) / h).max(axis=0)


def _vertices(first: Array, rise: Array, fall: Array) -> Array:
    """Returns absolute speeds (m, n) at the vertices that lie within the pieces (m, n), 0 where none does.

    The speed at the share u is first + 2 u rise + u² (fall - rise), whose vertex is at u = rise / (rise - fall).
    """
    turns = rise * fall < 0
    bend = np.where(turns, rise - fall, 1.0)
    return np.where(turns, np.abs(first + rise * rise / bend), 0.0)


def _workspace_fault(trajectory: JointTrajectory, *, stage: TiltStage, settings: GateSettings) -> str:
    pose = stage.world_from_base @ pivot_pose(stage.model, trajectory.position_rad)
    away = pose[:, :3, 3] - stage.pivot_m
    stray = math.sqrt(float((away * away).sum(axis=1).max()))
    if not stray <= settings.pivot_tolerance_m:
        allowed = settings.pivot_tolerance_m
        return f"the pivot would stray {stray * 1000:.1f} mm from its place (at most {allowed * 1000:.1f})"
    tilt = math.degrees(math.acos(min(1.0, max(-1.0, float(pose[:, 2, 2].min())))))
    if not tilt <= settings.max_tilt_deg:
        return f"the plate would tilt by {tilt:.1f} degrees (at most {settings.max_tilt_deg:.1f})"
    return ""


def _range(model: ArmModel, joint: int) -> str:
    return f"{math.degrees(model.lower_rad[joint]):.0f} to {math.degrees(model.upper_rad[joint]):.0f} degrees"

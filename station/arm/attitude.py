"""The plate's attitude, rate and pivot from the joints: forward kinematics in the form that goes on the bus."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from shared.geometry import Quaternion, quaternion_from_matrix
from shared.messages import PlatformState
from station.arm.drivers import JointReading
from station.arm.tilt_path import TiltStage
from station.rig.arm_model import joint_transforms

Array = NDArray[np.float64]


def platform_state(stage: TiltStage, reading: JointReading) -> PlatformState:
    """World_from_plate, the plate's angular velocity in its own frame, and the pivot in the world.

    The angular velocity is the sum over the joints of rate times axis.
    """
    model = stage.model
    pose, rate = stage.world_from_base, np.zeros(3)
    speeds = reading.velocity_rad_s.tolist()
    steps = joint_transforms(model, reading.position_rad)
    for step, axis, speed in zip(steps, model.joint_axes, speeds, strict=True):
        pose = pose.dot(step)
        rate += pose.dot(axis)[:3] * speed
    pose = pose.dot(model.last_from_pivot)
    rotation = pose[:3, :3]
    qw, qx, qy, qz = _quaternion(rotation)
    wx, wy, wz = rate.dot(rotation).tolist()
    px, py, pz = pose[:3, 3].tolist()
    return PlatformState(reading.stamp_ns, qw, qx, qy, qz, wx, wy, wz, px, py, pz, "world")


def _quaternion(rotation: Array) -> Quaternion:
    """Unit quaternion of a rotation (3, 3): directly below 120 degrees of turn, where nearly all tilts are."""
    (m00, m01, m02), (m10, m11, m12), (m20, m21, m22) = rotation.tolist()
    trace = m00 + m11 + m22
    if trace <= 0:
        return quaternion_from_matrix(rotation)
    scale = 2 * math.sqrt(1 + trace)
    return scale / 4, (m21 - m12) / scale, (m02 - m20) / scale, (m10 - m01) / scale

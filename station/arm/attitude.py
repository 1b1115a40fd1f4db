"""The plate's attitude, rate and pivot from the joints: forward kinematics in the form that goes on the bus."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from shared.geometry import Quaternion, quaternion_from_matrix
from shared.messages import PlatformState
from station.arm.drivers import JointReading
from station.arm.tilt_path import TiltStage

Array = NDArray[np.float64]


class Attitude:
    """Forward kinematics of one arm in its place, prepared once, because it runs a hundred times a second.

    A frame is carried as (4, 5): its pose, and the angular velocity as a fifth column. Joint i multiplies it by the
    (5, 5) matrix P + sin(q) S + cos(q) C + dq/dt W: Rodrigues' three parts (`ArmModel.rodrigues`), and in W the joint's
    axis, which its own turn leaves where it is.
    """

    def __init__(self, stage: TiltStage) -> None:
        model = stage.model
        n = len(model.joints)
        parts = np.zeros((n, 4, 5, 5))
        for k, part in enumerate(model.rodrigues):
            parts[:, k, :4, :4] = part
        parts[:, 0, 4, 4] = 1.0
        # With the angle at zero: at any other the axis is the same.
        parts[:, 3, :4, 4] = np.einsum("nij,nj->ni", model.rodrigues[0] + model.rodrigues[2], model.joint_axes)
        self._parts = parts.reshape(n, 4, 25)
        self._factors = np.ones((n, 1, 4))
        self._base = np.column_stack([stage.world_from_base, np.zeros(4)])
        self._last = np.eye(5)
        self._last[:4, :4] = model.last_from_pivot

    def state(self, reading: JointReading) -> PlatformState:
        """World_from_plate, the plate's angular velocity in its own frame, and the pivot in the world.

        The angular velocity is the sum over the joints of rate times axis.
        """
        factors = self._factors
        np.sin(reading.position_rad, out=factors[:, 0, 1])
        np.cos(reading.position_rad, out=factors[:, 0, 2])
        factors[:, 0, 3] = reading.velocity_rad_s
        pose = self._base
        for step in np.matmul(factors, self._parts).reshape(-1, 5, 5):
            pose = pose.dot(step)
        rows = pose.dot(self._last).tolist()
        (a, b, c, px, u), (d, e, f, py, v), (g, h, i, pz, w), _ = rows
        qw, qx, qy, qz = _quaternion(rows)
        wx, wy, wz = u * a + v * d + w * g, u * b + v * e + w * h, u * c + v * f + w * i
        return PlatformState(reading.stamp_ns, qw, qx, qy, qz, wx, wy, wz, px, py, pz, "world")


def _quaternion(rows: list[list[float]]) -> Quaternion:
    """Unit quaternion of a pose, row by row: directly below 120 degrees of turn, where nearly all tilts are."""
    (m00, m01, m02, *_), (m10, m11, m12, *_), (m20, m21, m22, *_), *_ = rows
    trace = m00 + m11 + m22
    if trace <= 0:
        return quaternion_from_matrix(np.array([row[:3] for row in rows[:3]]))
    scale = 2 * math.sqrt(1 + trace)
    return scale / 4, (m21 - m12) / scale, (m02 - m20) / scale, (m10 - m01) / scale

"""The plate's attitude, rate and pivot from the joints: forward kinematics in the form that goes on the bus."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from shared.messages import PlatformState
from station.arm.bindings import mj, place
from station.arm.drivers import JointReading
from station.arm.tilt_path import TiltStage
from station.rig.arm_model import transform

Array = NDArray[np.float64]
Numbers = tuple[float, float, float, float, float, float, float, float, float, float]
"""Quaternion (w, x, y, z), angular velocity (rad/s) and pivot (m)."""


class Attitude:
    """Forward kinematics of one arm in its place.

    MuJoCo's does it, on a chain of bare joints: in numpy it takes five times as long, which a simulated session, with a
    hundred attitudes a second, feels. A test holds it to `station.arm.kinematics`.
    """

    def __init__(self, stage: TiltStage) -> None:
        self._model = _chain(stage)
        self._data: Any = mj.MjData(self._model)
        pivot = int(self._model.body("pivot").id)
        # Views of MuJoCo's memory: joint angles in, the rest out.
        self._angles: Array = self._data.qpos
        self._axes: Array = self._data.xaxis
        self._place: Array = self._data.xpos[pivot]
        self._quaternion: Array = self._data.xquat[pivot]
        self._rotation: Array = self._data.xmat[pivot].reshape(3, 3)
        self._joints: tuple[Array, Array] | None = None
        self._numbers: Numbers = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

    def state(self, reading: JointReading) -> PlatformState:
        """Returns world_from_plate, the plate's angular velocity in its own frame, and the pivot in the world.

        A reading with the very arrays of the one before, which nobody writes to, is of an arm at rest.
        """
        joints = self._joints
        if joints is None or reading.position_rad is not joints[0] or reading.velocity_rad_s is not joints[1]:
            self._joints = reading.position_rad, reading.velocity_rad_s
            self._numbers = self._kinematics(*self._joints)
        return PlatformState(reading.stamp_ns, *self._numbers, "world")

    def _kinematics(self, position_rad: Array, velocity_rad_s: Array) -> Numbers:
        """Returns the quaternion, the angular velocity (the sum over the joints of rate times axis) and pivot."""
        self._angles[:] = position_rad
        mj.mj_kinematics(self._model, self._data)
        qw, qx, qy, qz = self._quaternion.tolist()
        if qw < 0:
            qw, qx, qy, qz = -qw, -qx, -qy, -qz
        wx, wy, wz = velocity_rad_s.dot(self._axes).dot(self._rotation).tolist()
        x, y, z = self._place.tolist()
        return qw, qx, qy, qz, wx, wy, wz, x, y, z


def _chain(stage: TiltStage) -> Any:
    """Returns the arm's joints without links, from the world to the pivot."""
    spec, arm = mj.MjSpec(), stage.model
    body = spec.worldbody.add_body(name="base", **place(stage.world_from_base))
    for joint in arm.joints:
        origin = transform(joint.origin_xyz_m, joint.origin_rpy_rad)
        # The mass has no meaning for the kinematics, but a moving body must weigh something.
        body = body.add_body(name=joint.name, mass=1.0, inertia=[1.0] * 3, explicitinertial=True, **place(origin))
        body.add_joint(name=joint.name, type=mj.mjtJoint.mjJNT_HINGE, axis=joint.axis)
    body.add_body(name="pivot", **place(arm.last_from_pivot))
    return spec.compile()

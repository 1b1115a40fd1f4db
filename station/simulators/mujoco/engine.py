"""One MuJoCo model with its state, and how it is stepped: in C, or in stages that turn the friction ellipse."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from station.simulators.mujoco.bindings import mj
from station.simulators.mujoco.specimen import Friction, FrictionDraw

FLOATS = NDArray[np.float64]
FEET = 8


class Bodies:
    """Where plate and block are in the world, as views of MuJoCo's memory: place (3,), rotation (9,), quaternion."""

    def __init__(self, data: Any, *, plate: int, block: int) -> None:
        self.data = data
        self.plate_place: FLOATS = data.xpos[plate]
        self.plate_rotation: FLOATS = data.xmat[plate]
        self.plate_quaternion: FLOATS = data.xquat[plate]
        self.block_place: FLOATS = data.xpos[block]
        self.block_quaternion: FLOATS = data.xquat[block]


class Engine:
    """A compiled model and its data; the first `joints` coordinates are the arm's in every model of the twin.

    The views `qpos`, `qvel`, `act`, `ctrl` are MuJoCo's own memory.
    """

    def __init__(self, model: Any, *, joints: int) -> None:
        self.model = model
        self.data = mj.MjData(model)
        self.scratch = mj.MjData(model)
        self.joints = joints
        self.qpos: FLOATS = self.data.qpos
        self.qvel: FLOATS = self.data.qvel
        self.act: FLOATS = self.data.act
        self.ctrl: FLOATS = self.data.ctrl
        self.plate = int(model.body("plate").id)
        self.block = int(model.body("block").id)
        self.joint_position: FLOATS = self.qpos[:joints]
        self.joint_velocity: FLOATS = self.qvel[:joints]
        self.joint_effort: FLOATS = self.data.qfrc_actuator[:joints]
        self.bodies = Bodies(self.data, plate=self.plate, block=self.block)
        self._bodies_ahead = Bodies(self.scratch, plate=self.plate, block=self.block)
        self._per_joint: FLOATS = np.empty((3, model.nv))

    def take(self, other: Engine) -> None:
        """Goes on from the state of another engine; the block's too, where both have it as a free body."""
        n = self.joints
        if len(self.qpos) == len(other.qpos):
            n = len(self.qpos)
        self.qpos[:n] = other.qpos[:n]
        speeds = min(len(self.qvel), len(other.qvel))
        self.qvel[:speeds] = other.qvel[:speeds]
        self.act[:] = other.act
        self.ctrl[:] = other.ctrl
        self.data.qacc_warmstart[:speeds] = other.data.qacc_warmstart[:speeds]

    def step(self, count: int) -> None:
        """Advances by `count` time steps."""
        mj.mj_step(self.model, self.data, count)

    def update_poses(self) -> None:
        """Makes the bodies' poses those of the present state (a step leaves them one step old)."""
        mj.mj_kinematics(self.model, self.data)

    def speed_of_block(self, joint_rad_s: FLOATS) -> float:
        """How fast (m/s) joints that turn at `joint_rad_s`, (n,), would move the place where the block is."""
        mj.mj_jac(self.model, self.data, self._per_joint, None, self.bodies.block_place, self.plate)
        x, y, z = self._per_joint[:, : self.joints].dot(joint_rad_s).tolist()
        return math.sqrt(x * x + y * y + z * z)

    def poses_after(self, seconds: float) -> Bodies:
        """The bodies as they are in the present state, carried on for less than a step at its velocity."""
        if seconds == 0.0:
            self.update_poses()
            return self.bodies
        self.scratch.qpos[:] = self.qpos
        mj.mj_integratePos(self.model, self.scratch.qpos, self.qvel, seconds)
        mj.mj_kinematics(self.model, self.scratch)
        return self._bodies_ahead


class ContactEngine(Engine):
    """An engine whose block lies on the plate by contact, with a circular or elliptic limit curve."""

    def __init__(self, model: Any, *, joints: int, friction: Friction) -> None:
        super().__init__(model, joints=joints)
        self._isotropic = friction.isotropic
        self._carrier = self.block if friction.fixed_in == "object" else self.plate
        self._axis: FLOATS = np.array([math.cos(friction.axis_rad), math.sin(friction.axis_rad), 0.0])
        self._plate_geom = int(model.geom("plate").id)

    def set_friction(self, draw: FrictionDraw) -> None:
        """The friction of the feet on the plate from now on."""
        self.model.pair_friction[:FEET, 0] = draw.mu_along
        self.model.pair_friction[:FEET, 1] = draw.mu_across

    def step(self, count: int) -> None:
        """Advances by `count` time steps."""
        if self._isotropic:
            super().step(count)
            return
        for _ in range(count):
            step_in_stages(self.model, self.data, self._turn_ellipse)

    def _turn_ellipse(self) -> None:
        """Lays the first tangent of each foot's contact along the axis of the limit curve.

        MuJoCo lays it along the world's y axis, which follows neither plate nor object.
        """
        data = self.data
        frames: FLOATS = data.contact.frame
        for number, geoms in enumerate(data.contact.geom):
            if self._plate_geom in geoms:
                frame = frames[number]
                axis = data.xmat[self._carrier].reshape(3, 3) @ self._axis
                set_tangents(frame, axis)

    def force_from_foam(self) -> FLOATS:
        """Sum of the foam's contact forces on the block in the plate frame, (3,), N."""
        data, total, wrench = self.data, np.zeros(3), np.empty(6)
        contact = data.contact
        for number, (first, second) in enumerate(contact.geom.tolist()):
            if self._plate_geom in (first, second):
                continue
            mj.mj_contactForce(self.model, data, number, wrench)
            # The contact's normal points from its first geom to its second, and so does the force on the second.
            force = contact.frame[number].reshape(3, 3).T @ wrench[:3]
            total += force if self.model.geom_bodyid[second] == self.block else -force
        return data.xmat[self.plate].reshape(3, 3).T @ total


def set_tangents(frame: FLOATS, axis: FLOATS) -> None:
    """Overwrites the tangents of a contact frame, (9,): the first is `axis`, (3,), laid into the contact's plane."""
    nx, ny, nz = frame[0:3].tolist()
    ax, ay, az = axis.tolist()
    along = nx * ax + ny * ay + nz * az
    tx, ty, tz = ax - along * nx, ay - along * ny, az - along * nz
    length = math.sqrt(tx * tx + ty * ty + tz * tz)
    if length < 1e-6:  # the axis stands on the plate: the block has tipped over, and any direction is as good
        return
    tx, ty, tz = tx / length, ty / length, tz / length
    frame[3:9] = (tx, ty, tz, ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx)


def step_in_stages(model: Any, data: Any, after_collision: Any) -> None:
    """One `mj_step` (Euler), stage by stage, with a call between collision and constraints.

    Without the call it gives the same bits as `mj_step`; a test holds it to that.
    """
    mj.mj_kinematics(model, data)
    mj.mj_comPos(model, data)
    mj.mj_camlight(model, data)
    mj.mj_makeM(model, data)
    mj.mj_factorM(model, data)
    mj.mj_collision(model, data)
    after_collision()
    mj.mj_makeConstraint(model, data)
    mj.mj_island(model, data)
    mj.mj_transmission(model, data)
    mj.mj_projectConstraint(model, data)
    mj.mj_fwdVelocity(model, data)
    mj.mj_fwdActuation(model, data)
    mj.mj_fwdAcceleration(model, data)
    mj.mj_fwdConstraint(model, data)
    mj.mj_Euler(model, data)

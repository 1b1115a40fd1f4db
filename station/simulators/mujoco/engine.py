"""The twin's two kinds of MuJoCo models with their states: the arm, and the block on the plate; and how they step.

The block is stepped in C, or in stages that turn the friction ellipse.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from station.simulators.mujoco.bindings import mj
from station.simulators.mujoco.grip import Three
from station.simulators.mujoco.poses import Bodies, Pose
from station.simulators.mujoco.specimen import Friction, FrictionDraw

FLOATS = NDArray[np.float64]
FEET = 8


class ArmEngine:
    """The arm with its plate, on which the block weighs as a part of it.

    MuJoCo's steps are semi-implicit, so a velocity belongs to half a step before the places. The arm is read at the
    velocities' moments: its last look begins and ends half a step before its last step does, and has one acceleration.
    It can be read at any moment of that look. What the bodies hold is MuJoCo's own memory.
    """

    def __init__(self, model: Any, *, joint_start_rad: FLOATS, damping: float) -> None:
        self.model = model
        self.data = mj.MjData(model)
        self._between = mj.MjData(model)
        self._act: FLOATS = self.data.act
        self._ctrl: Any = self.data.ctrl
        self._pack = struct.Struct(f"{model.nu}d").pack_into
        self.plate, self.block = int(model.body("plate").id), int(model.body("block").id)
        self._position: FLOATS = self.data.qpos
        self._velocity: FLOATS = self.data.qvel
        self._explicit_effort: FLOATS = self.data.qfrc_actuator
        self._damping = damping
        self._bodies = Bodies(self.data, plate=self.plate, block=self.block)
        self._bodies_between = Bodies(self._between, plate=self.plate, block=self.block)
        self._position_between: FLOATS = self._between.qpos
        self._per_joint: FLOATS = np.empty((3, model.nv))
        self._position[:] = self._act[:] = joint_start_rad
        self._n = int(model.nv)
        self._step_s = float(model.opt.timestep)
        self._now = self._before = self._at_velocities()
        """Positions and then velocities of the joints, (2 n,), at the two ends of the last look: never written to."""
        self._posed = False
        self._turned: list[float] | None = None
        self._turned_before: list[float] | None = None
        """world_from_plate at the end and at the beginning of the last look, once somebody has asked for it."""

    @property
    def servo_rad(self) -> list[float]:
        """The positions (n,), rad, to which the servos pull the joints."""
        return self._act.tolist()

    def step(self, *, wanted_rad_s: Sequence[float]) -> None:
        """Advances by one time step, in which the servos move at these velocities."""
        self._pack(self._ctrl, 0, *wanted_rad_s, *wanted_rad_s)  # springs and dampers; numpy takes five times as long
        mj.mj_step(self.model, self.data)
        self._before, self._now = self._now, self._at_velocities()
        self._turned_before, self._turned, self._posed = self._turned, None, False

    def halt(self, *, below_rad_s: float) -> bool:
        """Brings the joints to rest where they are, if none is faster than that; True if they rest."""
        if float(np.abs(self._velocity).max()) >= below_rad_s:
            return False
        self._position[:], self._velocity[:] = self._now[: self._n], 0.0
        self._now = self._before = self._at_velocities()
        self._posed = False
        return True

    def _at_velocities(self) -> FLOATS:
        """Gives positions and velocities of the joints at the velocities' moment, half a step before the positions'."""
        return np.concatenate((self._position - 0.5 * self._step_s * self._velocity, self._velocity))

    def joints(self, share: float = 1.0) -> tuple[FLOATS, FLOATS, FLOATS]:
        """Returns position, velocity and effort, each (n,) and never written to again, at that share of the last look.

        The effort is the one that the step was made with: its damping acts on the velocity that the step ends with.
        """
        n, state = self._n, self._now
        change = state - self._before
        effort = self._explicit_effort - self._damping * change[n:]
        if share != 1.0:
            state = self._before + share * change
            state[:n] -= 0.5 * share * (1.0 - share) * self._step_s * change[n:]
        return state[:n], state[n:], effort

    def carry(self, pose: Pose, *, mass_kg: float) -> None:
        """Makes the block a part of the plate at `pose`, with that mass."""
        self.model.body_mass[self.block] = mass_kg
        self.model.body_pos[self.block] = pose.position
        self.model.body_quat[self.block] = pose.quaternion
        self._posed = False

    @property
    def bodies(self) -> Bodies:
        """The bodies half a step after the last look (MuJoCo's step leaves them one step old)."""
        if not self._posed:
            mj.mj_kinematics(self.model, self.data)
            self._posed = True
        return self._bodies

    def bodies_at(self, share: float) -> Bodies:
        """Returns the bodies as they were at that share of the last look."""
        self._position_between[:] = self.joints(share)[0]
        mj.mj_kinematics(self.model, self._between)
        return self._bodies_between

    def plate_quaternion_at(self, share: float) -> list[float]:
        """Gives world_from_plate at that share of the last look, as the mean of its two ends (the same within 1e-5)."""
        after: list[float] = self._turned or self.bodies_at(1.0).plate_quaternion.tolist()
        self._turned = after
        if share == 1.0:
            return after
        before: list[float] = self._turned_before or self.bodies_at(0.0).plate_quaternion.tolist()
        self._turned_before = before
        (a, b, c, d), (e, f, g, h) = before, after
        w, x, y, z = a + share * (e - a), b + share * (f - b), c + share * (g - c), d + share * (h - d)
        length = math.sqrt(w * w + x * x + y * y + z * z)
        return [w / length, x / length, y / length, z / length]

    def speed_of_block(self, joint_rad_s: Sequence[float]) -> float:
        """Returns the speed (m/s) of the block's place when the joints turn at `joint_rad_s` (n,)."""
        mj.mj_jac(self.model, self.data, self._per_joint, None, self.bodies.block_place, self.plate)
        x, y, z = self._per_joint.dot(joint_rad_s).tolist()
        return math.sqrt(x * x + y * y + z * z)


class BlockEngine:
    """A block that lies on the plate by contact, seen from the plate: what moves the plate pulls at the block.

    `qpos` is the block's place and quaternion in the plate's frame, (7,), `qvel` its velocities there, (6,).
    """

    def __init__(self, model: Any, *, friction: Friction) -> None:
        self.model = model
        self.data = mj.MjData(model)
        self.qpos: FLOATS = self.data.qpos
        self.qvel: FLOATS = self.data.qvel
        self._options, self._gravity = model.opt, model.opt.gravity
        self._step_s = float(model.opt.timestep)
        self._isotropic, self._in_object = friction.isotropic, friction.fixed_in == "object"
        self._axis: FLOATS = np.array([math.cos(friction.axis_rad), math.sin(friction.axis_rad), 0.0])
        self._plate_geom = int(model.geom("plate").id)
        self._block = int(model.body("block").id)
        self._rotation: FLOATS = self.data.xmat[self._block].reshape(3, 3)
        self._bordered = int(model.npair) > FEET

    def set_friction(self, draw: FrictionDraw) -> None:
        """Sets the friction of the feet on the plate from now on."""
        self.model.pair_friction[:FEET, 0] = draw.mu_along
        self.model.pair_friction[:FEET, 1] = draw.mu_across

    def lay(self, pose: Pose) -> None:
        """Lays the block down at rest."""
        self.qpos[:3], self.qpos[3:] = pose.position, pose.quaternion
        self.qvel[:] = 0.0
        self.data.qacc_warmstart[:] = 0.0

    def take(self, other: BlockEngine) -> None:
        """Continues from the state of another engine."""
        self.qpos[:], self.qvel[:] = other.qpos, other.qvel
        self.data.qacc_warmstart[:] = other.data.qacc_warmstart

    def step(self, count: int, *, pull: Three, step_s: float) -> None:
        """Advances by `count` time steps under `pull`, the acceleration (m/s², plate frame) of what nothing holds."""
        if step_s != self._step_s:
            self._options.timestep = self._step_s = step_s
        self._gravity[:] = pull
        if self._isotropic:
            mj.mj_step(self.model, self.data, count)
            return
        for _ in range(count):
            step_in_stages(self.model, self.data, self._turn_ellipse)

    def pose_after(self, seconds: float) -> Pose:
        """Returns plate_from_block in the present state, carried on for less than a step at its velocity."""
        qpos = self.qpos
        if seconds:
            qpos = qpos.copy()
            mj.mj_integratePos(self.model, qpos, self.qvel, seconds)
        x, y, z, a, b, c, d = qpos.tolist()
        return Pose((x, y, z), (a, b, c, d) if a >= 0 else (-a, -b, -c, -d))

    def _turn_ellipse(self) -> None:
        """Lays the first tangent of each foot's contact along the axis of the limit curve.

        MuJoCo lays it along the world's y axis, which follows neither plate nor object.
        """
        contact = self.data.contact
        frames: FLOATS = contact.frame
        axis = self._rotation.dot(self._axis) if self._in_object else self._axis
        if self._bordered:
            plate = self._plate_geom
            feet = [frames[number] for number, geoms in enumerate(contact.geom.tolist()) if plate in geoms]
        else:
            feet = list(frames)
        for frame in feet:
            set_tangents(frame, axis)

    def force_from_foam(self) -> FLOATS:
        """Returns the sum of the foam's contact forces on the block in the plate frame, (3,), N."""
        data, model, plate, total = self.data, self.model, self._plate_geom, np.zeros(3)
        contact = data.contact
        pairs = contact.geom.tolist()
        pressed = [number for number, pair in enumerate(pairs) if plate not in pair]
        if not pressed:
            return total
        frames, bodies, wrench = contact.frame, model.geom_bodyid, np.empty(6)
        for number in pressed:
            mj.mj_contactForce(model, data, number, wrench)
            # The contact's normal points from its first geom to its second, and so does the force on the second.
            force = frames[number].reshape(3, 3).T @ wrench[:3]
            total += force if bodies[pairs[number][1]] == self._block else -force
        return total


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
    """Does one `mj_step` (Euler), stage by stage, with a call between collision and constraints.

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

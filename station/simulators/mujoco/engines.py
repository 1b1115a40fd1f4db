"""The three models of one arm with its plate and block, and how a state goes on from one to another."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from station.simulators.mujoco import model
from station.simulators.mujoco.bindings import mj
from station.simulators.mujoco.engine import ContactEngine, Engine
from station.simulators.mujoco.poses import Pose
from station.simulators.mujoco.specimen import Friction, FrictionDraw

FLOATS = NDArray[np.float64]


class Engines:
    """`welded` has the block as a part of the plate, `free` lets it lie by contact, `bordered` lets it touch the foam.

    Who steps keeps the engine at hand; the methods that change it give the one to go on with.
    """

    def __init__(self, scene: model.Scene, *, friction: Friction, joint_start_rad: FLOATS) -> None:
        joints = len(scene.arm.joints)
        self._joints, self._block, self._plate = joints, scene.block, scene.plate
        self.welded = Engine(model.build(scene, welded=True), joints=joints)
        self.free = ContactEngine(model.build(scene, welded=False), joints=joints, friction=friction)
        self.bordered = ContactEngine(model.build(scene, welded=False, bordered=True), joints=joints, friction=friction)
        self.welded.qpos[:] = self.welded.act[:] = joint_start_rad

    def set_friction(self, draw: FrictionDraw) -> None:
        """The friction of the block on the plate from now on."""
        self.free.set_friction(draw)
        self.bordered.set_friction(draw)

    def weld(self, engine: Engine, pose: Pose) -> Engine:
        """Makes the block a part of the plate, where it is on it."""
        welded = self.welded
        if engine is not welded:
            welded.take(engine)
        welded.model.body_mass[welded.block] = self._block.mass_kg
        welded.model.body_pos[welded.block] = pose.position
        welded.model.body_quat[welded.block] = pose.quaternion
        welded.update_poses()
        return welded

    def make_absent(self) -> None:
        """Takes the block's mass off the plate; `weld` brings it back."""
        self.welded.model.body_mass[self.welded.block] = 1e-9

    def unweld(self, pose: Pose) -> Engine:
        """Makes the block, which is a part of the plate at `pose`, a body of its own again, moving with the plate."""
        welded, free = self.welded, self.free
        data, n = welded.data, self._joints
        mj.mj_fwdPosition(welded.model, data)
        mj.mj_comVel(welded.model, data)
        speed = np.empty(6)
        mj.mj_objectVelocity(welded.model, data, mj.mjtObj.mjOBJ_XBODY, welded.block, speed, 0)
        free.take(welded)
        free.qpos[n : n + 3] = data.xpos[welded.block]
        free.qpos[n + 3 : n + 7] = data.xquat[welded.block]
        free.qvel[n : n + 3] = speed[3:]
        free.qvel[n + 3 : n + 6] = data.xmat[welded.block].reshape(3, 3).T @ speed[:3]
        free.data.qacc_warmstart[n:] = 0.0
        if math.hypot(*pose.position[:2]) + self._block.side_m + 1e-3 <= self._plate.cutout_radius_m:
            return free
        self.bordered.take(free)
        return self.bordered

    def within_reach(self, engine: Engine, *, reach_m: float) -> Engine:
        """The engine for a block by contact that may come as far as `reach_m` from the plate's centre in one look."""
        wanted = self.bordered if reach_m > self._plate.cutout_radius_m else self.free
        if wanted is not engine:
            wanted.take(engine)
            wanted.update_poses()
        return wanted

    def foam_push(self, engine: Engine) -> tuple[float, float]:
        """What the foam pushes the block with, per mass, along the plate (m/s², plate frame)."""
        if engine is not self.bordered:
            return (0.0, 0.0)
        push = self.bordered.force_from_foam() / self._block.mass_kg
        return (float(push[0]), float(push[1]))

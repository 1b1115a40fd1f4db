"""The three models of one rig, and how a block goes on from one to another."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from station.simulators.mujoco import model
from station.simulators.mujoco.engine import ArmEngine, BlockEngine
from station.simulators.mujoco.poses import Pose
from station.simulators.mujoco.specimen import Friction, FrictionDraw

FLOATS = NDArray[np.float64]
ABSENT_KG = 1e-9


class Engines:
    """`arm` moves the plate; a loose block is in `free`, or in `bordered` where it can touch the foam.

    Who steps keeps the block's engine at hand; the methods that change it give the one to go on with.
    """

    def __init__(self, scene: model.Scene, *, friction: Friction, joint_start_rad: FLOATS) -> None:
        self._block, self._free_radius_m = scene.block, scene.plate.opening.free_radius_m
        self.arm = ArmEngine(model.build_arm(scene), joint_start_rad=joint_start_rad, damping=model.SERVO_DAMPING)
        self.free = BlockEngine(model.build_block(scene, bordered=False), friction=friction)
        self.bordered = BlockEngine(model.build_block(scene, bordered=True), friction=friction)

    def set_friction(self, draw: FrictionDraw) -> None:
        """Sets the friction of the block on the plate from now on."""
        self.free.set_friction(draw)
        self.bordered.set_friction(draw)

    def weld(self, pose: Pose) -> None:
        """Makes the block a part of the plate, where it is on it."""
        self.arm.carry(pose, mass_kg=self._block.mass_kg)

    def make_absent(self) -> None:
        """Takes the block's mass off the plate; `weld` brings it back."""
        self.arm.model.body_mass[self.arm.block] = ABSENT_KG

    def unweld(self, pose: Pose) -> BlockEngine:
        """Makes the block, which is a part of the plate at `pose`, a body of its own again, at rest on the plate."""
        reach_m = math.hypot(*pose.position[:2]) + self._block.side_m + 1e-3
        engine = self.free if reach_m <= self._free_radius_m else self.bordered
        engine.lay(pose)
        return engine

    def within_reach(self, engine: BlockEngine, *, reach_m: float) -> BlockEngine:
        """Gives the engine for a loose block that may come as far as `reach_m` from the plate's centre in one look."""
        wanted = self.bordered if reach_m > self._free_radius_m else self.free
        if wanted is not engine:
            wanted.take(engine)
        return wanted

    def foam_push(self, engine: BlockEngine) -> tuple[float, float]:
        """Returns the foam's push on the block per mass, along the plate (m/s², plate frame)."""
        if engine is not self.bordered:
            return (0.0, 0.0)
        push = self.bordered.force_from_foam() / self._block.mass_kg
        return (float(push[0]), float(push[1]))

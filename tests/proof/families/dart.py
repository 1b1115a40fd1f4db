"""DART, Gazebo's default engine, with steps of a millisecond. Its friction is a pyramid, on axes fixed in the world.

So its block slips up to 2° late between the axes: its worlds are artefacts, and no nulls.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from tests.proof.engine_bench import Array, Engine
from tests.proof.engine_family import EngineFamily
from tests.proof.patch_world.world import Contact

STEP_S = 1e-3


class DartBlock:
    """A box on a large box."""

    step_s = STEP_S

    def __init__(self, contact: Contact) -> None:
        self._dart: Any = importlib.import_module("dartpy")
        self._mass, self._half_height = contact.mass, 0.5 * contact.height
        self._world: Any = self._dart.simulation.World()
        self._world.setTimeStep(STEP_S)
        size = [2 * contact.half_x, 2 * contact.half_y, contact.height]
        self._block = self._box("block", size, contact.mass, fixed=False)
        plate = self._box("plate", [1.0, 1.0, 0.1], 1.0, fixed=True)
        place = self._dart.math.Isometry3()
        place.set_translation([0.0, 0.0, -0.05])
        plate.getParentJoint().setTransformFromParentBodyNode(place)
        self._rub(plate, 1.0)

    def _box(self, name: str, size: list[float], mass: float, *, fixed: bool) -> Any:
        dynamics = self._dart.dynamics
        skeleton = dynamics.Skeleton(name)
        make = skeleton.createWeldJointAndBodyNodePair if fixed else skeleton.createFreeJointAndBodyNodePair
        _, body = make()
        shape = dynamics.BoxShape(size)
        node = body.createShapeNode(shape)
        node.createCollisionAspect()
        node.createDynamicsAspect()
        inertia = dynamics.Inertia()
        inertia.setMass(mass)
        inertia.setMoment(shape.computeInertia(mass))
        body.setInertia(inertia)
        self._world.addSkeleton(skeleton)
        return body

    @staticmethod
    def _rub(body: Any, mu: float) -> None:
        body.getShapeNode(0).getDynamicsAspect().setFrictionCoeff(mu)

    def put(self, x: float, y: float, yaw: float, *, mu: float) -> None:
        """See `Engine`; the lower of both bodies' coefficients counts."""
        self._rub(self._block, mu)
        place = self._dart.math.Isometry3()
        place.set_rotation(self._dart.math.eulerXYZToMatrix([0.0, 0.0, yaw]))
        place.set_translation([x, y, self._half_height])
        skeleton = self._block.getSkeleton()
        skeleton.setPositions(self._dart.dynamics.FreeJoint.convertToPositions(place))
        skeleton.setVelocities(np.zeros(6))

    def step(self, pull: Array, force: Array, moment: float) -> None:
        """See `Engine`."""
        self._world.setGravity(pull)
        self._block.addExtForce([float(force[0]), float(force[1]), 0.0], [0.0, 0.0, 0.0], False, True)
        self._block.addExtTorque([0.0, 0.0, moment], False)
        self._world.step()

    def read(self) -> tuple[float, float, float, float, float, float]:
        """See `Engine`."""
        pose = self._block.getWorldTransform()
        x, y, _ = pose.translation()
        turn, moves, spins = pose.rotation(), self._block.getLinearVelocity(), self._block.getAngularVelocity()
        yaw = math.atan2(turn[1, 0], turn[0, 0])
        return float(x), float(y), yaw, float(moves[0]), float(moves[1]), float(spins[2])


class Dart(EngineFamily):
    """The family of worlds whose contact is DART's; the module says how."""

    name: ClassVar[str] = "dart"
    title: ClassVar[str] = "DART"
    place: ClassVar[int] = 43
    module: ClassVar[str] = "dartpy"
    number: ClassVar[int] = 3
    full: ClassVar[Mapping[str, int]] = MappingProxyType({"artefact": 6})

    def engine(self, contact: Contact) -> Engine:
        """See `DartBlock`."""
        return DartBlock(contact)

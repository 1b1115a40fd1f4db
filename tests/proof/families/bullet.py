"""Bullet with a true friction cone, many iterations, steps of a millisecond and a block that cannot tip or turn.

It shares the load out between the corners one after the other, and the block's rocking makes up for it. So a free box
slides with -6.4 to -.2 % of its coefficient, in a quarter of the step, too, as its corners do not all go one way. A
block with a large inertia slides with it to .01 %. With 50 iterations and steps of 1/240 s, which are its own, and a
free box it is bad numerics.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar

from tests.proof.engine_bench import Array, Engine
from tests.proof.engine_family import EngineFamily
from tests.proof.patch_world.world import Contact

STEP_S = 1e-3
INERTIA = [1e3] * 3
"""kg m²: enough for a block that neither tips nor turns."""


class BulletBlock:
    """A box on a plane in a world of its own."""

    def __init__(self, contact: Contact, *, step_s: float = STEP_S, good: bool = True) -> None:
        self.step_s = step_s
        self._bullet: Any = importlib.import_module("pybullet")
        client: Any = importlib.import_module("pybullet_utils.bullet_client")
        self._client: Any = client.BulletClient(connection_mode=self._bullet.DIRECT)
        self._client.setPhysicsEngineParameter(
            fixedTimeStep=step_s, numSolverIterations=500 if good else 50, enableConeFriction=int(good)
        )
        half = [contact.half_x, contact.half_y, 0.5 * contact.height]
        plane = self._client.createCollisionShape(self._bullet.GEOM_PLANE)
        box = self._client.createCollisionShape(self._bullet.GEOM_BOX, halfExtents=half)
        plate = self._client.createMultiBody(0.0, plane)
        self._block: int = self._client.createMultiBody(contact.mass, box, basePosition=[0.0, 0.0, half[2]])
        self._client.changeDynamics(plate, -1, lateralFriction=1.0, restitution=0.0)
        self._client.changeDynamics(
            self._block, -1, lateralFriction=contact.mu, spinningFriction=0.0, rollingFriction=0.0, restitution=0.0,
            linearDamping=0.0, angularDamping=0.0, activationState=self._bullet.ACTIVATION_STATE_DISABLE_SLEEPING,
        )  # fmt: skip
        if good:
            self._client.changeDynamics(self._block, -1, localInertiaDiagonal=INERTIA)
        self._half_height = half[2]

    def put(self, x: float, y: float, yaw: float, *, mu: float) -> None:
        """See `Engine`; its friction is the product of both bodies'."""
        self._client.changeDynamics(self._block, -1, lateralFriction=mu)
        turn = self._client.getQuaternionFromEuler([0.0, 0.0, yaw])
        self._client.resetBasePositionAndOrientation(self._block, [x, y, self._half_height], turn)
        self._client.resetBaseVelocity(self._block, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0])

    def step(self, pull: Array, force: Array, moment: float) -> None:
        """See `Engine`."""
        self._client.setGravity(*pull.tolist())
        if force[0] or force[1] or moment:
            place, _ = self._client.getBasePositionAndOrientation(self._block)
            push, frame = [float(force[0]), float(force[1]), 0.0], self._bullet.WORLD_FRAME
            self._client.applyExternalForce(self._block, -1, push, place, frame)
            self._client.applyExternalTorque(self._block, -1, [0.0, 0.0, moment], frame)
        self._client.stepSimulation()

    def read(self) -> tuple[float, float, float, float, float, float]:
        """See `Engine`."""
        place, turn = self._client.getBasePositionAndOrientation(self._block)
        velocity, spin = self._client.getBaseVelocity(self._block)
        yaw = self._client.getEulerFromQuaternion(turn)[2]
        return place[0], place[1], yaw, velocity[0], velocity[1], spin[2]


class Bullet(EngineFamily):
    """The family of worlds whose contact is PyBullet's; the module says how."""

    name: ClassVar[str] = "bullet"
    title: ClassVar[str] = "Bullet"
    place: ClassVar[int] = 41
    module: ClassVar[str] = "pybullet"
    number: ClassVar[int] = 1
    full: ClassVar[Mapping[str, int]] = MappingProxyType({**EngineFamily.full, "artefact": 6})

    def engine(self, contact: Contact) -> Engine:
        """See `BulletBlock`."""
        return BulletBlock(contact)

    def bad(self, contact: Contact) -> Engine:
        """Returns an engine as it comes: friction on two axes, 240 Hz (steps of 4.2 ms, in whole ticks)."""
        return BulletBlock(contact, step_s=4.2e-3, good=False)

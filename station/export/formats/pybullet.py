"""The model in PyBullet: friction and forces are set before each step, as Bullet calls nobody back in Python.

Bullet multiplies the friction of two bodies: the plate gets 1, the block what the law says.
"""

from __future__ import annotations

import importlib
import math
from typing import Any

import numpy as np

from station.export.carried.law import Law
from station.export.carried.watch import Moment, Watch
from station.export.exported import ExportedFile
from station.export.from_model import NamedModel
from station.export.python_file import CORNERS, SAID, python_file
from station.physics.contact import Array
from station.physics.model import Model

NAME = "pybullet"
HELP = "the model for PyBullet: friction and forces before each step (Python)"


def export_model(named: NamedModel) -> tuple[ExportedFile, ...]:
    """Returns one file."""
    how = [
        f"Friction of a block as {named.stem} says it, for PyBullet.",
        "friction = Friction(client, Law(MODEL, Watch()), plate=…, block=…) with the numbers of two bodies, and "
        "friction.before_step(gravity) before each client.stepSimulation(), gravity (3,), m/s², in the world. Give "
        "Watch what you know: Watch({'mass_kg': 0.02, 'run': 3}).",
        "Steps of 1 ms, SETTINGS and a friction anchor (see PybulletBench) are part of it: with Bullet's own a block "
        "creeps, and starts at other angles.",
    ]
    supported = SAID - {"creep"}
    return (python_file(named, engine="PyBullet", supported=supported, caveats=CORNERS, how=how, bench=bench),)


class Friction:
    """A law at work between two bodies; P is the plate's frame."""

    def __init__(self, client: Any, law: Law, *, plate: int, block: int) -> None:
        """`client` is pybullet itself, or a BulletClient."""
        self.law, self._client, self._plate, self._block = law, client, plate, block
        self._step_s = float(client.getPhysicsEngineParameters()["fixedTimeStep"])
        dynamics = client.getDynamicsInfo(block, -1)
        self._mass, self._inertia, self._time_s = float(dynamics[0]), float(np.mean(dynamics[2])), 0.0
        client.changeDynamics(plate, -1, lateralFriction=1.0)

    def before_step(self, gravity: Array) -> None:
        """Asks the law, sets the friction of the coming step, and adds its force and torque to it.

        `gravity` (3,), m/s², is in the world's frame.
        """
        client = self._client
        plate_m, plate_turn = client.getBasePositionAndOrientation(self._plate)
        block_m, block_turn = client.getBasePositionAndOrientation(self._block)
        turn, heading = _matrix(client, plate_turn), _matrix(client, block_turn)[:, 0]
        arm = np.subtract(block_m, plate_m)
        action = self.law.act(self._moment(turn, arm, heading, gravity), step_s=self._step_s)
        client.changeDynamics(self._block, -1, lateralFriction=action.mu)
        force, torque = turn @ (self._mass * action.force), turn @ np.array([0.0, 0.0, self._inertia * action.turn])
        client.applyExternalForce(self._block, -1, force.tolist(), block_m, client.WORLD_FRAME)
        client.applyExternalTorque(self._block, -1, torque.tolist(), client.WORLD_FRAME)
        self._time_s += self._step_s

    def _moment(self, turn: Array, arm: Array, heading: Array, gravity: Array) -> Moment:
        """Returns the block's motion in the plate's frame."""
        plate_v, plate_w = (np.array(one) for one in self._client.getBaseVelocity(self._plate))
        block_v, block_w = (np.array(one) for one in self._client.getBaseVelocity(self._block))
        slip, spin = turn.T @ (block_v - plate_v - np.cross(plate_w, arm)), turn.T @ (block_w - plate_w)
        x, y, _ = (turn.T @ arm).tolist()
        along, across, _ = (turn.T @ heading).tolist()
        place, velocity = np.array([x, y, math.atan2(across, along)]), np.array([slip[0], slip[1], spin[2]])
        return Moment(self._time_s, turn.T @ gravity, place, velocity)


def _matrix(client: Any, quaternion: Any) -> Array:
    return np.array(client.getMatrixFromQuaternion(quaternion)).reshape(3, 3)


SETTINGS = {"enableConeFriction": 1, "solverResidualThreshold": 0.0}
"""Bullet alone stops iterating at a residual of 1e-7, so that a block of some grams creeps by 0.2 mm in a second."""


class PybulletBench:
    """A cube on a plate, with gravity that turns."""

    def __init__(self, model: Model, *, side_m: float = 0.01, mass_kg: float = 0.00785, step_s: float = 1e-3) -> None:
        """Makes them in a world of their own."""
        bullet: Any = importlib.import_module("pybullet")
        client: Any = importlib.import_module("pybullet_utils.bullet_client").BulletClient(bullet.DIRECT)
        self.step_s, self._client = step_s, client
        client.setPhysicsEngineParameter(fixedTimeStep=step_s, **SETTINGS)
        shapes = [
            client.createCollisionShape(bullet.GEOM_BOX, halfExtents=half) for half in ([0.1] * 3, [side_m / 2] * 3)
        ]
        plate = client.createMultiBody(0, shapes[0], basePosition=[0, 0, -0.1])
        self._block = client.createMultiBody(mass_kg, shapes[1], basePosition=[0, 0, side_m / 2])
        client.changeDynamics(self._block, -1, frictionAnchor=1, linearDamping=0.0, angularDamping=0.0)
        self.friction = Friction(client, Law(model, Watch()), plate=plate, block=self._block)

    def advance(self, gravity: Array) -> Array:
        """Takes one step under gravity (3,), m/s², in the plate's frame.

        It returns x, y (m) and yaw (rad), (3,), after it.
        """
        self._client.setGravity(*gravity)
        self.friction.before_step(gravity)
        self._client.stepSimulation()
        (x, y, _), turn = self._client.getBasePositionAndOrientation(self._block)
        return np.array([x, y, self._client.getEulerFromQuaternion(turn)[2]])


def bench(model: Model) -> PybulletBench:
    """Returns a block at rest in the middle of the plate."""
    return PybulletBench(model)

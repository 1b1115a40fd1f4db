"""PyBullet, by the exported loader; its own time step is set to a millisecond."""

from __future__ import annotations

import importlib
import importlib.util
from pathlib import Path
from typing import Any

import numpy as np

from tests.recovery.engines import Array

NAME = "Bullet"
MODULE = "pybullet"
FORMAT = "bullet"
ANISOTROPIC = True


class BulletBench:
    """A world of its own; gravity is in the world, whose axes are those of the measured body."""

    def __init__(self, folder: Path, stem: str, *, object_yaw_rad: float, step_s: float) -> None:
        self.step_s = step_s
        bullet: Any = importlib.import_module("pybullet")
        client: Any = importlib.import_module("pybullet_utils.bullet_client")
        self._client: Any = client.BulletClient(connection_mode=bullet.DIRECT)
        spec = importlib.util.spec_from_file_location(f"{stem}_bullet", folder / f"{stem}_bullet.py")
        assert spec
        assert spec.loader
        loader: Any = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(loader)
        _, self._object = loader.load(self._client)
        self._client.setPhysicsEngineParameter(fixedTimeStep=self.step_s)
        place, turn = self._client.getBasePositionAndOrientation(self._object)
        more = self._client.getQuaternionFromEuler([0, 0, object_yaw_rad])
        _, turned = self._client.multiplyTransforms([0, 0, 0], more, [0, 0, 0], turn)
        self._client.resetBasePositionAndOrientation(self._object, place, turned)

    def advance(self, gravity_m_s2: Array) -> None:
        """One time step."""
        self._client.setGravity(*gravity_m_s2)
        self._client.stepSimulation()

    def place_m(self) -> Array:
        """Returns the place of the object's middle (3,), m, in the world."""
        return np.array(self._client.getBasePositionAndOrientation(self._object)[0])

    def close(self) -> None:
        """Ends the world."""
        self._client.disconnect()


def load(folder: Path, stem: str, *, object_yaw_rad: float = 0.0) -> BulletBench:
    """Runs the exported loader."""
    return BulletBench(folder, stem, object_yaw_rad=object_yaw_rad, step_s=1e-3)

"""DART, Gazebo's default engine. Its own SDF reader skips friction and its Python knows one coefficient a body.

So the bodies are DART's reading of the exported file, and mu is put in as gz-physics does it: what the file says of
each surface. Directions cannot be tried this way; the file must say the same for mu and mu2.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from tests.recovery.engines import Array

NAME = "DART"
MODULE = "dartpy"
FORMAT = "gazebo"
ANISOTROPIC = False


class DartBench:
    """Gravity is the world's."""

    def __init__(self, path: Path) -> None:
        dart: Any = importlib.import_module("dartpy")
        self._world: Any = dart.utils.SdfParser.readWorld(str(path))
        self.step_s = float(self._world.getTimeStep())
        for name, mu in surfaces(path).items():
            body = self._world.getSkeleton(name).getBodyNode(0)
            for index in range(body.getNumShapeNodes()):
                aspect = body.getShapeNode(index).getDynamicsAspect()
                if aspect:
                    aspect.setFrictionCoeff(mu)
        self._object: Any = self._world.getSkeleton("object").getBodyNode(0)

    def advance(self, gravity_m_s2: Array) -> None:
        """One time step."""
        self._world.setGravity(gravity_m_s2)
        self._world.step()

    def place_m(self) -> Array:
        """Returns the object's place (3,), m, in the world."""
        return np.array(self._object.getWorldTransform().translation())

    def close(self) -> None:
        """Nothing to free."""


def surfaces(path: Path) -> dict[str, float]:
    """The coefficient of each model's surface."""
    found: dict[str, float] = {}
    for model in ElementTree.parse(path).iter("model"):
        mu, mu2 = (float(model.findtext(f".//ode/{name}", "nan")) for name in ("mu", "mu2"))
        assert mu == mu2
        found[model.attrib["name"]] = mu
    return found


def load(folder: Path, stem: str, *, object_yaw_rad: float = 0.0) -> DartBench:
    """The world of an isotropic pair."""
    assert object_yaw_rad == 0.0
    return DartBench(folder / f"{stem}.gazebo.sdf")

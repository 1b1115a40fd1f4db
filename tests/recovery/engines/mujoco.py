"""MuJoCo, with the exported model as it stands: its option, pair and poses."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

from tests.recovery.engines import Array

NAME = "MuJoCo"
MODULE = "mujoco"
FORMAT = "mujoco"
ANISOTROPIC = True


class MujocoBench:
    """Gravity is turned into the world by the measured body's own pose in the file."""

    def __init__(self, path: Path, *, measured: str) -> None:
        self._mj: Any = importlib.import_module("mujoco")
        self._model: Any = self._mj.MjModel.from_xml_path(str(path))
        self._data: Any = self._mj.MjData(self._model)
        self.step_s = float(self._model.opt.timestep)
        self._mj.mj_forward(self._model, self._data)
        self._to_world: Array = self._data.body(measured).xmat.reshape(3, 3).copy()

    def advance(self, gravity_m_s2: Array) -> None:
        """One time step."""
        self._model.opt.gravity[:] = self._to_world @ gravity_m_s2
        self._mj.mj_step(self._model, self._data)

    def place_m(self) -> Array:
        """Returns the place of the object's body (3,), m, in the world."""
        place: Array = self._data.body("object").xpos.copy()
        return place

    def close(self) -> None:
        """Nothing to free."""


def load(folder: Path, stem: str, *, object_yaw_rad: float = 0.0) -> MujocoBench:
    """The object lies as the file says: MuJoCo's ellipse does not turn with it."""
    assert object_yaw_rad == 0.0
    path = folder / f"{stem}.mjcf.xml"
    turned = '<body name="object" quat' in path.read_text(encoding="utf-8")
    return MujocoBench(path, measured="object" if turned else "plate")

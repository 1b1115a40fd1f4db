"""PhysX 5 on the CPU, by NVIDIA's ovphysx, with the exported stage as it stands.

Needs ovphysx, ovstage, warp-lang and physx-usd-schemas: a gigabyte, so that no extra of ours asks for it.
"""

from __future__ import annotations

import importlib
import itertools
import warnings
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from tests.recovery.engines import Array
from tests.recovery.engines.tilt import G_M_S2

NAME = "PhysX"
MODULE = "ovphysx"
FORMAT = "usd"
ANISOTROPIC = False

_NUMBERS = itertools.count(1)


class PhysxBench:
    """Gravity is the stage's; what is left of it comes as a force at the object's middle."""

    step_s = 1e-3

    def __init__(self, path: Path) -> None:
        engine, stages = _libraries()
        self._physx: Any = engine.PhysX()
        self._stage: Any = stages.Stage(f"stage_{next(_NUMBERS)}")
        stages.population.open_usd(self._stage, str(path), ordinal=1, domains=stages.PopulationDomain.ALL)
        self._stage.advance_write_floor(ordinal=1).wait()
        self._physx.wait_task(self._physx.attach_ovstage(self._stage, read_ordinal=1))
        self._physx.warmup()
        self._physx.wait_all()
        kinds: Any = importlib.import_module("ovphysx.types").TensorType
        with warnings.catch_warnings():  # their replacement takes a hundred lines for the same
            warnings.simplefilter("ignore", DeprecationWarning)
            bind = self._physx.create_tensor_binding
            self._pose: Any = bind(pattern="/World/Object", tensor_type=kinds.RIGID_BODY_POSE)
            self._wrench: Any = bind(pattern="/World/Object", tensor_type=kinds.RIGID_BODY_WRENCH)
            mass: Any = bind(pattern="/World/Object", tensor_type=kinds.RIGID_BODY_MASS)
        read = np.zeros(mass.shape, dtype=np.float32)
        mass.read(read)
        mass.destroy()
        self._mass_kg = float(read.ravel()[0])

    def advance(self, gravity_m_s2: Array) -> None:
        """One time step."""
        wrench = np.zeros((1, 9), dtype=np.float32)
        wrench[0, :3] = self._mass_kg * (gravity_m_s2 - np.array([0.0, 0.0, -G_M_S2]))
        wrench[0, 6:] = self.place_m()
        self._wrench.write(wrench)
        self._physx.step_sync(self.step_s)

    def place_m(self) -> Array:
        """Returns the place of the object's middle (3,), m, in the world."""
        pose = np.zeros(self._pose.shape, dtype=np.float32)
        self._pose.read(pose)
        return pose[0, :3].astype(np.float64)

    def close(self) -> None:
        """Takes the stage away before the engine."""
        for binding in (self._pose, self._wrench):
            binding.destroy()
        self._physx.wait_task(self._physx.detach_ovstage())
        self._stage.destroy()
        self._physx.destroy()


@cache
def _libraries() -> tuple[Any, Any]:
    """PhysX on the CPU and the stages that it reads; PhysX's words for USD are made known once a process."""
    engine: Any = importlib.import_module("ovphysx")
    stages: Any = importlib.import_module("ovstage")
    schemas: Any = importlib.import_module("ovphysx.samples.python_samples.schema_support")
    engine.PhysX.set_cpu_mode(True)
    stages.population.register_usd_schemas([str(path) for path in schemas.physx_schema_paths()])
    return engine, stages


def load(folder: Path, stem: str, *, object_yaw_rad: float = 0.0) -> PhysxBench:
    """PhysX has no friction by direction: the object's yaw has no part in it."""
    assert object_yaw_rad == 0.0
    return PhysxBench(folder / f"{stem}.usda")

"""Drake, discrete, with the contact approximation that the exported file asks for."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np

from tests.recovery.engines import Array
from tests.recovery.engines.tilt import G_M_S2

NAME = "Drake"
MODULE = "pydrake"
FORMAT = "drake"
ANISOTROPIC = False


class DrakeBench:
    """Drake's gravity is fixed once a plant is final: the rest of it comes as a force at the object's middle."""

    step_s = 2e-3
    """The time step of the tilt; the plant's own is half of it."""

    def __init__(self, path: Path) -> None:
        drake: Any = importlib.import_module("pydrake.all")
        builder = drake.DiagramBuilder()
        self._plant, _ = drake.AddMultibodyPlantSceneGraph(builder, time_step=self.step_s / 2)
        drake.Parser(self._plant).AddModels(str(path))
        self._plant.set_discrete_contact_approximation(drake.DiscreteContactApproximation.kSap)
        self._plant.mutable_gravity_field().set_gravity_vector([0, 0, -G_M_S2])
        self._plant.Finalize()
        diagram = builder.Build()
        context = diagram.CreateDefaultContext()
        self._context = self._plant.GetMyContextFromRoot(context)
        self._simulator = drake.Simulator(diagram, context)
        self._simulator.Initialize()
        self._body = self._plant.GetBodyByName("object")
        self._mass_kg = float(self._body.default_mass())
        self._push = drake.ExternallyAppliedSpatialForce()
        self._push.body_index = self._body.index()
        self._push.p_BoBq_B = self._body.default_com()
        self._force: Any = drake.SpatialForce
        self._time_s = 0.0

    def advance(self, gravity_m_s2: Array) -> None:
        """One time step."""
        beyond = gravity_m_s2 - np.array([0.0, 0.0, -G_M_S2])
        self._push.F_Bq_W = self._force(tau=np.zeros(3), f=self._mass_kg * beyond)
        self._plant.get_applied_spatial_force_input_port().FixValue(self._context, [self._push])
        self._time_s += self.step_s
        self._simulator.AdvanceTo(self._time_s)

    def place_m(self) -> Array:
        """Returns the object's place (3,), m, in the world."""
        place: Array = self._plant.EvalBodyPoseInWorld(self._context, self._body).translation().copy()
        return place

    def close(self) -> None:
        """Nothing to free."""


def load(folder: Path, stem: str, *, object_yaw_rad: float = 0.0) -> DrakeBench:
    """Drake has no friction by direction: the object's yaw has no part in it."""
    assert object_yaw_rad == 0.0
    return DrakeBench(folder / f"{stem}.drake.sdf")

"""Drake's discrete contact (SAP) with steps of a millisecond.

It creeps by its regularisation, at a thousandth of what the pull would do in a step: 3 µm/s at 18°, 4 µm on a ramp of
8°/s, and in steps of tilt some 30 µm before a slip, which the tool called presliding in the one null that was tried (24
runs). Shorter steps would creep less, and take more than the 2.7 s of processor time that a run takes. So its
worlds are artefacts, and no nulls.
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


class DrakeBlock:
    """A box on a half space. Its gravity and friction are final once it is built: a contact is a new plant."""

    step_s = STEP_S

    def __init__(self, contact: Contact) -> None:
        self._drake: Any = importlib.import_module("pydrake.all")
        self._contact, self._time_s = contact, 0.0
        self.put(0.0, 0.0, 0.0, mu=contact.mu)

    def put(self, x: float, y: float, yaw: float, *, mu: float) -> None:
        """See `Engine`."""
        drake, c = self._drake, self._contact
        builder = drake.DiagramBuilder()
        plant, _ = drake.AddMultibodyPlantSceneGraph(builder, time_step=STEP_S)
        plant.set_discrete_contact_approximation(drake.DiscreteContactApproximation.kSap)
        plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
        size = [2 * c.half_x, 2 * c.half_y, c.height]
        inertia = drake.SpatialInertia.SolidBoxWithMass(c.mass, *size)
        self._body: Any = plant.AddRigidBody("block", inertia)
        friction, level = drake.CoulombFriction(mu, mu), drake.RigidTransform()
        corners = [(i * c.half_x, j * c.half_y, -0.5 * c.height) for i in (-1, 1) for j in (-1, 1)]
        for number, corner in enumerate(corners):  # a box on a plane has one point of contact in Drake
            place = drake.RigidTransform([*corner[:2], corner[2] + 1e-6])
            plant.RegisterCollisionGeometry(self._body, place, drake.Sphere(1e-6), f"corner {number}", friction)
        plant.RegisterCollisionGeometry(plant.world_body(), level, drake.HalfSpace(), "plate", friction)
        plant.Finalize()
        diagram = builder.Build()
        context = diagram.CreateDefaultContext()
        self._plant, self._context = plant, plant.GetMyContextFromRoot(context)
        turn = drake.RollPitchYaw(0.0, 0.0, yaw)
        plant.SetFreeBodyPose(self._context, self._body, drake.RigidTransform(turn, [x, y, 0.5 * c.height]))
        self._push: Any = drake.ExternallyAppliedSpatialForce()
        self._push.body_index, self._push.p_BoBq_B = self._body.index(), np.zeros(3)
        self._simulator: Any = drake.Simulator(diagram, context)
        plant.get_applied_spatial_force_input_port().FixValue(self._context, [self._push])
        self._simulator.Initialize()
        self._steps = 0

    def step(self, pull: Array, force: Array, moment: float) -> None:
        """See `Engine`."""
        total = self._contact.mass * pull
        total[:2] += force
        self._push.F_Bq_W = self._drake.SpatialForce(tau=np.array([0.0, 0.0, moment]), f=total)
        self._plant.get_applied_spatial_force_input_port().FixValue(self._context, [self._push])
        self._steps += 1
        self._simulator.AdvanceTo(self._steps * STEP_S)

    def read(self) -> tuple[float, float, float, float, float, float]:
        """See `Engine`."""
        pose = self._plant.EvalBodyPoseInWorld(self._context, self._body)
        speed = self._plant.EvalBodySpatialVelocityInWorld(self._context, self._body)
        x, y, _ = pose.translation().tolist()
        turn = pose.rotation().matrix()
        moves, spins = speed.translational(), speed.rotational()
        yaw = math.atan2(turn[1, 0], turn[0, 0])
        return x, y, yaw, float(moves[0]), float(moves[1]), float(spins[2])


class Drake(EngineFamily):
    """The family of worlds whose contact is Drake's; the module says how."""

    name: ClassVar[str] = "drake"
    title: ClassVar[str] = "Drake"
    place: ClassVar[int] = 42
    module: ClassVar[str] = "pydrake"
    number: ClassVar[int] = 2
    full: ClassVar[Mapping[str, int]] = MappingProxyType({"artefact": 6})

    def engine(self, contact: Contact) -> Engine:
        """See `DrakeBlock`."""
        return DrakeBlock(contact)

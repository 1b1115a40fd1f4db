"""The model in Drake: a force on top of the constant friction of the scene, found anew before each step.

Drake's coefficients are fixed once a plant is built. The force is the difference: along the motion by (mu₀ − mu) N, mu₀
being the scene's; at rest along the load, and never more than would hold it. N is taken from the load, so the block may
be pressed on by nothing else.
"""

from __future__ import annotations

import importlib
import math
from typing import Any

import numpy as np

from station.export.carried.law import Action, Law
from station.export.carried.watch import Moment, Watch
from station.export.exported import ExportedFile, named
from station.export.formats import drake as scenes
from station.export.from_model import NamedModel
from station.export.measured import MeasuredPair
from station.export.python_file import CORNERS, SAID, python_file
from station.physics.contact import GRAVITY_M_S2, Array
from station.physics.model import Model

NAME = "drake"
HELP = "the model for Drake: a force before each step (Python)"


def export_model(named_model: NamedModel) -> tuple[ExportedFile, ...]:
    """Returns one file with the force and a scene."""
    mu = named_model.model.mu_s
    pair = MeasuredPair(object="block", plate="plate", mu_1=mu, mu_2=mu, remarks=("The force adds what it lacks.",))
    how = [
        f"Friction of a block as {named_model.stem} says it, for Drake.",
        "friction = Friction(plant, Law(MODEL, Watch()), plate=…, block=…) with two bodies of a discrete, final plant "
        "whose coefficient between them is MODEL.mu_s; before each Simulator.AdvanceTo give friction.force(context, "
        "step_s=…, gravity=…) to plant.get_applied_spatial_force_input_port().FixValue(context, [force]). gravity "
        "(3,), m/s², is the world's. Give Watch what you know: Watch({'mass_kg': 0.02, 'run': 3}).",
        "The TAMSI approximation with a small stiction tolerance, and small spheres as feet (see DrakeBench and SCENE) "
        "are part of it: with Drake's own settings a block starts more than a degree early, and with SAP one on small "
        "feet hops while it slides.",
    ]
    supported = SAID - {"creep"}
    (scene,) = scenes.export(named([pair]))
    file = python_file(
        named_model, engine="Drake", supported=supported, caveats=CORNERS, how=how, bench=bench, scene=scene.text
    )
    return (file,)


class Friction:
    """A law at work between two bodies of a plant; P is the plate body's frame."""

    def __init__(self, plant: Any, law: Law, *, plate: Any, block: Any) -> None:
        """`plate` and `block` are the plant's own bodies, such as plant.GetBodyByName("block")."""
        self.law, self._plant, self._plate, self._block = law, plant, plate, block
        self._drake: Any = importlib.import_module("pydrake.all")

    def force(self, context: Any, *, step_s: float, gravity: Array) -> Any:
        """Returns the ExternallyAppliedSpatialForce for the next `step_s`, under gravity (3,), m/s², in the world."""
        turn, now = self._moment(context, gravity)
        action = self.law.act(now, step_s=step_s)
        along = _difference(action, now, mu=self.law.model.mu_s)
        mass = self._block.get_mass(context)
        inertia = self._block.CalcSpatialInertiaInBodyFrame(context).CalcRotationalInertia().get_moments()
        push = self._drake.ExternallyAppliedSpatialForce()
        push.body_index, push.p_BoBq_B = self._block.index(), self._block.CalcCenterOfMassInBodyFrame(context)
        push.F_Bq_W = self._drake.SpatialForce(
            tau=turn @ np.array([0.0, 0.0, float(np.mean(inertia)) * action.turn]),
            f=turn @ (mass * (action.force + along)),
        )
        return push

    def _moment(self, context: Any, gravity: Array) -> tuple[Array, Moment]:
        """Returns world_from_plate, and the block's motion in the plate's frame."""
        plate, block = (body.EvalPoseInWorld(context) for body in (self._plate, self._block))
        turn = plate.rotation().matrix()
        relative = plate.inverse() @ block
        moves = self._block.body_frame().CalcSpatialVelocity(
            context, self._plate.body_frame(), self._plate.body_frame()
        )
        heading = relative.rotation().matrix()[:, 0]
        x, y, _ = relative.translation().tolist()
        slip, spin = moves.translational(), moves.rotational()
        place, velocity = (
            np.array(three) for three in ((x, y, math.atan2(heading[1], heading[0])), (*slip[:2], spin[2]))
        )
        return turn, Moment(context.get_time(), turn.T @ gravity, place, velocity)


def _difference(action: Action, now: Moment, *, mu: float) -> Array:
    """Returns the force per mass (3,), m/s², in P, that friction with `mu` lacks to the law's, along motion or load."""
    load = math.hypot(*action.load)
    lacking = (mu - action.mu) * action.normal
    if not action.moving:
        return np.append(action.load * max(lacking / load, -1.0), 0.0) if load else np.zeros(3)
    speed = now.speed_m_s
    ahead = now.velocity[:2] / speed if speed > 0 else action.load / max(load, 1e-12)
    return np.append(lacking * ahead, 0.0)


STICTION_M_S = 1e-5
"""The speed at which friction is full: below it a block creeps. Drake's own 1e-3 starts it 0.11 degrees early."""


class DrakeBench:
    """The scene of this file. Drake's gravity is fixed in a final plant: what turns of it is a force on the block."""

    step_s = 1e-3

    def __init__(self, model: Model, scene: str) -> None:
        """Builds a plant of its own."""
        drake: Any = importlib.import_module("pydrake.all")
        builder = drake.DiagramBuilder()
        self._plant, _ = drake.AddMultibodyPlantSceneGraph(builder, time_step=self.step_s)
        drake.Parser(self._plant).AddModelsFromString(scene, "sdf")
        self._plant.set_discrete_contact_approximation(drake.DiscreteContactApproximation.kTamsi)
        self._plant.set_stiction_tolerance(STICTION_M_S)
        self._plant.mutable_gravity_field().set_gravity_vector([0, 0, -GRAVITY_M_S2])
        self._plant.Finalize()
        plate, self._block = (self._plant.GetBodyByName(name) for name in ("plate", "object"))
        diagram = builder.Build()
        context = diagram.CreateDefaultContext()
        self._context = self._plant.GetMyContextFromRoot(context)
        self._simulator: Any = drake.Simulator(diagram, context)
        self._simulator.Initialize()
        self.friction = Friction(self._plant, Law(model, Watch()), plate=plate, block=self._block)
        self._steps = 0

    def advance(self, gravity: Array) -> Array:
        """Takes one step under gravity (3,), m/s², in the plate's frame.

        It returns x, y (m) and yaw (rad), (3,), after it.
        """
        push = self.friction.force(self._context, step_s=self.step_s, gravity=gravity)
        mass = self._block.get_mass(self._context)
        turned = gravity + np.array([0.0, 0.0, GRAVITY_M_S2])
        push.F_Bq_W = type(push.F_Bq_W)(tau=push.F_Bq_W.rotational(), f=push.F_Bq_W.translational() + mass * turned)
        self._plant.get_applied_spatial_force_input_port().FixValue(self._context, [push])
        self._steps += 1
        self._simulator.AdvanceTo(self._steps * self.step_s)
        pose = self._block.EvalPoseInWorld(self._context)
        heading = pose.rotation().matrix()[:, 0]
        return np.array([*pose.translation()[:2], math.atan2(heading[1], heading[0])])


def bench(model: Model, scene: str) -> DrakeBench:
    """Returns a block at rest in the middle of the plate."""
    return DrakeBench(model, scene)

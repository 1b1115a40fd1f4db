"""The model in MuJoCo: a callback that sets friction and adds forces, and a scene whose contact holds a block.

MuJoCo calls `mjcb_passive` once in every step, after its contacts are made: the forces act in this step, the friction
in the next.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from station.export.carried.law import Action, Law
from station.export.carried.watch import Moment, Watch
from station.export.exported import ExportedFile, named
from station.export.formats import mujoco as scenes
from station.export.from_model import NamedModel
from station.export.measured import MeasuredPair
from station.export.python_file import MET_CORNERS, SAID, python_file
from station.physics.contact import Array
from station.physics.model import Model
from station.simulators.mujoco.bindings import mj

NAME = "mujoco-python"
HELP = "the model as a callback for MuJoCo (Python)"


def export_model(named_model: NamedModel) -> tuple[ExportedFile, ...]:
    """Returns one file with the callback and a scene."""
    mu = named_model.model.mu_s
    pair = MeasuredPair(object="block", plate="plate", mu_1=mu, mu_2=mu, remarks=("The callback sets it anew.",))
    how = [
        f"Friction of a block as {named_model.stem} says it, for MuJoCo.",
        'Friction(m, Law(MODEL, Watch(), corners_below_m=0.005), plate="plate", block="object").install() in your '
        "program, for the bodies of those names in your MjModel m, the block's mass 5 mm above the four corners that "
        "carry it; then step as ever (compile models before). The plate "
        "may move (by joints, not as a mocap body, which has no velocity in a contact) or gravity may turn. Give "
        "Watch what you know: Watch({'mass_kg': 0.02, 'run': 3}).",
        "Take the <option> and the <pair> of SCENE into your own scene: with MuJoCo's defaults a block starts many "
        "degrees early.",
    ]
    supported = SAID - {"creep"}
    (scene,) = scenes.export(named([pair]))
    file = python_file(
        named_model, engine="MuJoCo", supported=supported, caveats=MET_CORNERS, how=how, bench=bench, scene=scene.text
    )
    return (file,)


class Friction:
    """A law at work between two bodies of an MjModel; P is the plate body's frame."""

    def __init__(self, model: Any, law: Law, *, plate: str, block: str) -> None:
        """Refuses, by a KeyError of MuJoCo's, bodies that are not there."""
        self.law, self._plate, self._block = law, int(model.body(plate).id), int(model.body(block).id)
        of_plate, of_block = (set(np.flatnonzero(model.geom_bodyid == body)) for body in (self._plate, self._block))
        sides = [({one, other} & of_plate, {one, other} & of_block) for one, other in _pairs(model)]
        self._pairs = [number for number, (plates, blocks) in enumerate(sides) if plates and blocks]
        self._geoms = sorted(of_block)
        self._model, self._step_s = model, float(model.opt.timestep)
        model.geom_priority[self._geoms] = 1 + model.geom_priority.max()

    def install(self) -> None:
        """Lets MuJoCo call it from now on; mujoco.set_mjcb_passive(None) ends that."""
        mj.set_mjcb_passive(self)

    def __call__(self, model: Any, data: Any) -> None:
        """Asks the law, adds its force and torque to this step, and sets the next step's friction; for its model."""
        if model is not self._model:
            return
        turn = data.xmat[self._plate].reshape(3, 3)
        action = self.law.act(self._moment(model, data, turn), step_s=self._step_s)
        self._push(model, data, turn, action)
        model.pair_friction[self._pairs, :2] = action.mu
        model.geom_friction[self._geoms, 0] = action.mu

    def _moment(self, model: Any, data: Any, turn: Array) -> Moment:
        """Returns the block's motion in the plate's frame, from the bodies' places and velocities in the world's."""
        arm = data.xpos[self._block] - data.xpos[self._plate]
        plate, block = (_velocity(model, data, body) for body in (self._plate, self._block))
        slip = turn.T @ (block[3:] - plate[3:] - np.cross(plate[:3], arm))
        spin = turn.T @ (block[:3] - plate[:3])
        place, heading = turn.T @ arm, turn.T @ data.xmat[self._block].reshape(3, 3)[:, 0]
        yaw = math.atan2(heading[1], heading[0])
        where, moves = np.array([place[0], place[1], yaw]), np.array([slip[0], slip[1], spin[2]])
        return Moment(float(data.time), turn.T @ model.opt.gravity, where, moves)

    def _push(self, model: Any, data: Any, turn: Array, action: Action) -> None:
        inertia = float(model.body_inertia[self._block].mean())
        force = turn @ (model.body_mass[self._block] * action.force)
        torque = turn @ np.array([0.0, 0.0, inertia * action.turn])
        mj.mj_applyFT(model, data, force, torque, data.xipos[self._block], self._block, data.qfrc_passive)


def _pairs(model: Any) -> Any:
    return zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True)


def _velocity(model: Any, data: Any, body: int) -> Array:
    """Returns the angular and linear velocity (6,) of a body's origin, in the world's axes."""
    found = np.zeros(6)
    mj.mj_objectVelocity(model, data, mj.mjtObj.mjOBJ_XBODY, body, found, 0)
    return found


class MujocoBench:
    """The scene of this file, with gravity that turns."""

    def __init__(self, model: Model, scene: str) -> None:
        """Loads it and installs the callback; a model cannot be compiled while one is installed."""
        mj.set_mjcb_passive(None)
        self.model: Any = mj.MjModel.from_xml_string(scene)
        self.data: Any = mj.MjData(self.model)
        self.step_s = float(self.model.opt.timestep)
        self.friction = Friction(self.model, Law(model, Watch(), corners_below_m=0.005), plate="plate", block="object")
        self.friction.install()

    def advance(self, gravity: Array) -> Array:
        """Takes one step under gravity (3,), m/s², in the plate's frame.

        It returns x, y (m) and yaw (rad), (3,), after it.
        """
        self.model.opt.gravity[:] = gravity
        mj.mj_step(self.model, self.data)
        x, y, _, w, a, b, z = self.data.qpos.tolist()
        return np.array([x, y, math.atan2(2 * (w * z + a * b), 1 - 2 * (b * b + z * z))])


def bench(model: Model, scene: str) -> MujocoBench:
    """Returns a block at rest in the middle of the plate."""
    return MujocoBench(model, scene)

"""A block on a plate, in the plate's own frame: gravity turns instead of the plate, so that no joint has to carry it.

What the plate's motion does to the block (inertial forces) acts per mass and is added to gravity. A plate that is moved
as a mocap body would not do: MuJoCo gives it no velocity in contact.

Two kinds of block. The *even* one stands on one patch of contact under its mass, which resists turning by a torsional
coefficient, and cannot lean: MuJoCo's elliptic cone is then the ellipsoidal limit surface |F|² + (M/ρ)² = (mu N)², with
ρ = L / √12 (`station.physics.sole`), and sliding and turning share one friction. The *solid* one is what a user writes
down first: a box on a plane, its mass in its middle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from station.physics.sole import TURNING_RADIUS
from station.simulators.mujoco.bindings import mj
from station.simulators.mujoco.contact import EXACT, Contact
from station.simulators.mujoco.engine import set_tangents, step_in_stages

FLOATS = NDArray[np.float64]
FOOT_RADIUS_M = 0.0005
STEP_S = 0.002
_SETTLE_S = 0.5
_GRAVITY = 9.81
_MEMORY = 1 << 18
"""The bytes for the contacts of one block; MuJoCo's own choice is many times that, and there are hundreds of blocks."""


HOLDING = replace(EXACT, impratio=2e5)
"""The twin's contact, and one that holds better still: it shows the first millisecond of a slide."""


Solver = Literal["Newton", "CG", "PGS"]


@dataclass(frozen=True, kw_only=True)
class Setup:
    """The settings of MuJoCo: contact, time step, solver, iterations of it and of noslip, and which kind of block."""

    contact: Contact = HOLDING
    step_s: float = STEP_S
    noslip: int = 0
    solver: Solver = "Newton"
    iterations: int = 100
    solid: bool = False


@dataclass(frozen=True, kw_only=True)
class Load:
    """The load on one block in one step: force per mass (m/s², plate frame), turning (rad/s²) and friction.

    `friction` along and across the axis at `axis_rad`; both alike: no axis is needed.
    """

    pull: tuple[float, float, float]
    turn: float
    friction: tuple[float, float]
    axis_rad: float = 0.0


def build(setup: Setup, *, side_m: float, mass_kg: float) -> Any:
    """Builds the compiled model of one block on a plate."""
    return described(setup, side_m=side_m, mass_kg=mass_kg).compile()


def described(setup: Setup, *, side_m: float, mass_kg: float) -> Any:
    """Returns the model of `build` before it is compiled (`MjSpec`), so that more can be added."""
    spec = mj.MjSpec()
    spec.modelname, spec.memory = "block on a tilting plate", _MEMORY
    contact, option = setup.contact, spec.option
    option.timestep, option.noslip_iterations = setup.step_s, setup.noslip
    option.solver, option.iterations = _solvers()[setup.solver], setup.iterations
    option.cone = mj.mjtCone.mjCONE_ELLIPTIC if contact.elliptic else mj.mjtCone.mjCONE_PYRAMIDAL
    option.impratio, option.tolerance = contact.impratio, contact.tolerance
    spec.worldbody.add_geom(name="plate", type=mj.mjtGeom.mjGEOM_PLANE, size=[1, 1, 0.01], contype=0, conaffinity=0)
    block = spec.worldbody.add_body(name="block", pos=[0, 0, 0])
    if setup.solid:
        block.add_freejoint(name="block")
    else:
        for name, axis in (("x", [1, 0, 0]), ("y", [0, 1, 0]), ("z", [0, 0, 1])):
            block.add_joint(name=name, type=mj.mjtJoint.mjJNT_SLIDE, axis=axis)
        block.add_joint(name="yaw", type=mj.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
    block.mass, block.inertia = mass_kg, [mass_kg * side_m**2 / 6] * 3
    block.iquat, block.explicitinertial = [1, 0, 0, 0], True
    block.ipos = [0, 0, side_m / 2 if setup.solid else 0.0]
    _add_shape(block, setup, side_m)
    pair = spec.add_pair(geomname1="plate", geomname2="sole", condim=3 if setup.solid else 4)
    pair.solref, pair.solimp, pair.solreffriction = contact.solref, contact.solimp, contact.solref_friction
    return spec


def _solvers() -> dict[Solver, Any]:
    return {"Newton": mj.mjtSolver.mjSOL_NEWTON, "CG": mj.mjtSolver.mjSOL_CG, "PGS": mj.mjtSolver.mjSOL_PGS}


def _add_shape(block: Any, setup: Setup, side_m: float) -> None:
    """Adds the geom that touches the plate; the body's origin is in the sole."""
    half = side_m / 2
    plain: dict[str, Any] = {"name": "sole", "mass": 0.0, "contype": 0, "conaffinity": 0}
    if setup.solid:
        block.add_geom(type=mj.mjtGeom.mjGEOM_BOX, size=[half] * 3, pos=[0, 0, half], **plain)
        return
    position, size = [0, 0, FOOT_RADIUS_M], [FOOT_RADIUS_M, 0, 0]
    block.add_geom(type=mj.mjtGeom.mjGEOM_SPHERE, size=size, pos=position, **plain)


class Plate:
    """One compiled model, in which any number of blocks of one kind are stepped one after another."""

    def __init__(self, setup: Setup, *, side_m: float, mass_kg: float) -> None:
        self.setup = setup
        self.model = build(setup, side_m=side_m, mass_kg=mass_kg)
        self._gravity: FLOATS = self.model.opt.gravity
        self._friction: FLOATS = self.model.pair_friction
        self._reach_m = TURNING_RADIUS * side_m
        self._inertia = mass_kg * side_m**2 / 6
        self.sunk_m = self._settled()

    def _settled(self) -> float:
        """Returns the depth to which a block sinks into the level plate."""
        data = mj.MjData(self.model)
        self._gravity[:] = (0.0, 0.0, -_GRAVITY)
        mj.mj_step(self.model, data, round(_SETTLE_S / self.setup.step_s))
        return -float(data.qpos[2])

    def block(self) -> TiltedBlock:
        """Returns another block on this plate."""
        return TiltedBlock(self)

    def set_load(self, load: Load) -> None:
        """Sets what acts on the block that is stepped next."""
        self._gravity[:] = load.pull
        along, across = load.friction
        self._friction[:, :3] = along, across, self._reach_m * 0.5 * (along + across)

    @property
    def inertia(self) -> float:
        """The block's moment of inertia about the normal, kg m²."""
        return self._inertia


class TiltedBlock:
    """The state of one block: `qpos` is x, y, z of its sole and its yaw or quaternion, `qvel` what they change by."""

    def __init__(self, plate: Plate) -> None:
        self._plate = plate
        self._solid = plate.setup.solid
        self.data = mj.MjData(plate.model)
        self.qpos: FLOATS = self.data.qpos
        self.qvel: FLOATS = self.data.qvel

    def lay(self, pose: FLOATS, *, velocity: FLOATS, normal_m_s2: float) -> None:
        """Lays it down, sunk in as the normal load has it.

        Args:
            pose: (3,) x, y (m) and yaw (rad).
            velocity: (3,) their rates, m/s and rad/s.
            normal_m_s2: the normal load per mass, m/s².
        """
        x, y, yaw = pose.tolist()
        turned = (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)) if self._solid else (yaw,)
        self.qpos[:] = (x, y, -self._plate.sunk_m * normal_m_s2 / _GRAVITY, *turned)
        self.qvel[:] = 0.0
        self.qvel[0], self.qvel[1], self.qvel[-1] = velocity
        self.data.qacc_warmstart[:] = 0.0

    def begin(self, load: Load) -> None:
        """Takes the first step of a block that is laid down moving: half a kick.

        MuJoCo's velocities belong to the middles between places (a leapfrog), but the one given to the beginning. With
        a whole kick a block that is slowed by 2 m/s² would be 2 mm/s too slow from then on.
        """
        pose, velocity = self.qpos.copy(), self.qvel.copy()
        self.step(load)
        self.qvel[:] = 0.5 * (velocity + self.qvel)
        self.qpos[:] = pose
        mj.mj_integratePos(self._plate.model, self.qpos, self.qvel, self._plate.setup.step_s)

    def step(self, load: Load) -> None:
        """Takes one time step under the load at its beginning."""
        plate = self._plate
        plate.set_load(load)
        self.data.qfrc_applied[-1] = load.turn * plate.inertia
        if load.friction[0] == load.friction[1]:
            mj.mj_step(plate.model, self.data)
            return
        axis = np.array([math.cos(load.axis_rad), math.sin(load.axis_rad), 0.0])

        def turn_ellipse() -> None:
            for frame in self.data.contact.frame:
                set_tangents(frame, axis)

        step_in_stages(plate.model, self.data, turn_ellipse)

    def shift(self, x_m: float, y_m: float) -> None:
        """Moves it along the plate without a velocity: it creeps."""
        self.qpos[0] += x_m
        self.qpos[1] += y_m

    @property
    def pose(self) -> tuple[float, float, float]:
        """x, y (m) and yaw (rad, of a solid one within ± π) in the plate."""
        if not self._solid:
            x, y, _, yaw = self.qpos.tolist()
            return x, y, yaw
        x, y, _, w, a, b, z = self.qpos.tolist()
        return x, y, math.atan2(2 * (w * z + a * b), 1 - 2 * (b * b + z * z))

    @property
    def rates(self) -> tuple[float, float, float]:
        """The changes of x and y (m/s) and of the yaw (rad/s)."""
        vx, vy, *_, spin = self.qvel.tolist()
        return vx, vy, spin

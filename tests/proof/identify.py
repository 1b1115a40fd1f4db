"""Recorded slides to friction, by MuJoCo's own system identification (mujoco.sysid, an extra of its package).

The model is the block on a tilted plate of `tilted.py`, in the plate's frame, driven by the recorded gravity as three
forces. Of friction it has what MuJoCo has for such a block: a sliding coefficient, one for each slide because contacts
scatter, and a damping of its joints along the plate, one for all. They are found by `mujoco.sysid.optimize`, its least
squares over its own rollouts; of its solvers scipy's takes a seventh of the evaluations of MuJoCo's here, to the same
result.
"""

from __future__ import annotations

import contextlib
import importlib
import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from station.physics.sole import TURNING_RADIUS
from station.simulators.mujoco.bindings import mj
from station.simulators.mujoco.tilted import Setup, described

FLOATS = NDArray[np.float64]
LEAST_MU, MOST_MU, MOST_PER_S = 0.02, 2.0, 60.0
"""The bounds of the coefficient, and of the damping per mass."""
START_PER_S = 0.5
MOST_ITERATIONS, ENOUGH = 15, 1e-5


@dataclass(frozen=True, eq=False, kw_only=True)
class Slide:
    """One recorded slide in the plate's frame: `time_s` (n,) from 0, `place_m` (n, 2), its first velocity (2,).

    `gravity_m_s2` (n, 3) is what pulls a body there at those times.
    """

    time_s: FLOATS
    place_m: FLOATS
    velocity_m_s: FLOATS
    gravity_m_s2: FLOATS
    mass_kg: float


@dataclass(frozen=True, kw_only=True)
class Identified:
    """The sliding coefficients, one of each slide, and their damping (N s/m)."""

    mu: tuple[float, ...]
    drag_n_s_m: float


def sysid() -> Any:
    """The package, or None if its requirements are not installed."""
    found: Any = importlib.import_module("mujoco.sysid")
    return found if hasattr(found, "optimize") else None  # it swallows the error of a missing package


def identify(slides: Sequence[Slide], *, side_m: float) -> Identified:
    """The friction that makes the simulated slides most like the recorded ones."""
    package: Any = sysid()
    heaviest = max(slide.mass_kg for slide in slides)
    params = package.ParameterDict()
    for number, slide in enumerate(slides):
        params.add(package.Parameter(f"mu {number}", _balancing(slide), LEAST_MU, MOST_MU))
    params.add(package.Parameter("drag", START_PER_S * heaviest, 0.0, MOST_PER_S * heaviest))
    residual = _Residuals([_Simulated(package, number, slide, side_m) for number, slide in enumerate(slides)])
    # It prints every iteration, and hands no word to its solver to be silent.
    with contextlib.redirect_stdout(io.StringIO()):
        found, _ = package.optimize(
            params, residual, optimizer="scipy", verbose=False, max_iters=MOST_ITERATIONS, x_scale="jac",
            xtol=ENOUGH, ftol=ENOUGH, diff_step=1e-4,
        )  # fmt: skip
    mu = tuple(float(found[f"mu {number}"].value[0]) for number in range(len(slides)))
    return Identified(mu=mu, drag_n_s_m=float(found["drag"].value[0]))


def _balancing(slide: Slide) -> float:
    """The friction that would hold the block where the slide begins, which is a little more than it has."""
    pull = slide.gravity_m_s2[0]
    return min(max(float(np.hypot(pull[0], pull[1]) / -pull[2]), 2.0 * LEAST_MU), 0.5 * MOST_MU)


class _Residuals:
    """The function that `optimize` calls: the residuals of every slide, (x, params) → (list, _, _)."""

    def __init__(self, slides: Sequence[_Simulated]) -> None:
        self._slides = slides

    def __call__(self, x: FLOATS, params: Any) -> tuple[list[FLOATS], None, None]:
        """The simulated minus the recorded places, as the package computes them."""
        params.update_from_vector(x)
        return [slide.residual(x, params) for slide in self._slides], None, None


class _Simulated:
    """A slide in simulation. What was simulated with the same two numbers is not simulated again.

    A slope by another slide's coefficient does not concern it, and the package would simulate it all the same.
    """

    def __init__(self, package: Any, number: int, slide: Slide, side_m: float) -> None:
        group = _group(package, number, _along_x(slide), side_m)
        self._name, self._reach_m = f"mu {number}", TURNING_RADIUS * side_m
        self._model = group.spec.compile()
        self._residual = package.build_residual_fn(models_sequences=[group], build_model=self._build, n_threads=1)
        self._known: dict[tuple[float, float], FLOATS] = {}

    def residual(self, x: FLOATS, params: Any) -> FLOATS:
        """The simulated minus the recorded places, with the current parameters."""
        key = self._numbers(params)
        if key not in self._known:
            self._known[key] = self._residual(x, params)[0][0]
        return self._known[key]

    def _numbers(self, params: Any) -> tuple[float, float]:
        return float(params[self._name].value[0]), float(params["drag"].value[0])

    def _build(self, params: Any, _spec: Any) -> Any:
        """The compiled model with these parameters; it is reused, since compiling anew would take most of the time."""
        mu, drag = self._numbers(params)
        self._model.pair_friction[:, :3] = mu, mu, self._reach_m * mu
        self._model.dof_damping[:2] = drag
        return self._model


def _along_x(slide: Slide) -> Slide:
    """The slide turned to go along x: the package weighs each coordinate by its size, and across is but noise."""
    way = slide.place_m[-1] - slide.place_m[0]
    cosine, sine = way / max(float(np.hypot(*way)), 1e-9)
    turn = np.array([[cosine, sine], [-sine, cosine]])
    gravity = np.column_stack([slide.gravity_m_s2[:, :2] @ turn.T, slide.gravity_m_s2[:, 2]])
    return replace(slide, place_m=slide.place_m @ turn.T, velocity_m_s=turn @ slide.velocity_m_s, gravity_m_s2=gravity)


def _group(package: Any, number: int, slide: Slide, side_m: float) -> Any:
    """A slide as the package wants it: model, first state, forces, and what was seen."""
    spec = _driven(side_m=side_m, mass_kg=slide.mass_kg)
    model = spec.compile()
    # Places of joints, not of sensors: those of a step are of its beginning, and it takes them for the end.
    signals = [("x", package.SignalType.MjStateQPos)]
    return package.ModelSequences(
        f"slide {number}",
        spec,
        f"slide {number}",
        _begun(package, model, slide),
        package.TimeSeries(slide.time_s, slide.mass_kg * slide.gravity_m_s2),
        package.TimeSeries.from_names(slide.time_s, slide.place_m[:, :1], model, signals),
    )


def _driven(*, side_m: float, mass_kg: float) -> Any:
    """The model without gravity, which comes as forces, and with a sensor of the place."""
    spec = described(Setup(), side_m=side_m, mass_kg=mass_kg)
    spec.option.gravity = [0.0, 0.0, 0.0]
    for name in ("x", "y", "z"):
        spec.add_actuator(name=name, target=name, trntype=mj.mjtTrn.mjTRN_JOINT)
    spec.add_sensor(name="x", type=mj.mjtSensor.mjSENS_JOINTPOS, objtype=mj.mjtObj.mjOBJ_JOINT, objname="x")
    return spec


def _begun(package: Any, model: Any, slide: Slide) -> FLOATS:
    """A block that slides, sunk into the plate by its weight."""
    data = mj.MjData(model)
    data.ctrl[:] = 0.0, 0.0, slide.mass_kg * slide.gravity_m_s2[0, 2]
    mj.mj_step(model, data, round(0.3 / model.opt.timestep))
    place = np.array([*slide.place_m[0], float(data.qpos[2]), 0.0])
    return package.create_initial_state(model, place, np.array([*slide.velocity_m_s, 0.0, 0.0]))

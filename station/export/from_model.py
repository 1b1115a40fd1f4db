"""A model as a format gets it, and as the friction of a pair where friction by direction is all that it says."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from shared.errors import UserError
from station.export.carried.states import contact
from station.export.measured import FixedIn, MeasuredPair
from station.physics.contact import Array, Contact
from station.physics.model import Model, Term
from station.physics.reversals import SWINGS

_STATES, _SEED = 200, 1
_WAYS: Array = np.linspace(0, 2 * math.pi, 72, endpoint=False)
_EQUAL = 1e-6
"""Relative differences of friction that are rounding, or a table's error (`station/physics/held.py`)."""


@dataclass(frozen=True, slots=True)
class NamedModel:
    """A model with the name that its files get: letters, digits and underscores."""

    stem: str
    model: Model


def named_model(path: Path, model: Model) -> NamedModel:
    """Returns the model with the name of its file."""
    stem = re.sub(r"\W+", "_", path.stem, flags=re.ASCII).strip("_").lower() or "model"
    return NamedModel(f"model_{stem}" if stem[0].isdigit() else stem, model)


def pair_of_model(model: Model, *, to: str) -> MeasuredPair:
    """Returns the friction of a model as a pair's, for the format `to` that knows friction by direction alone.

    Raises:
        UserError: naming what acts otherwise, or depends on more.
    """
    others = [term.effect.id for term in model.terms if _acts_beyond(model, term)]
    if others:
        raise UserError(
            f"Expected a model of friction by direction alone for --format {to}, got {', '.join(others)} in it; "
            "export to a format of Python (numpy, mujoco-python, pybullet, drake)"
        )
    fixed_in: FixedIn = "object" if _varies(model, yaw_rad=_WAYS) else "plate"
    mu_1, mu_2, axis = _ellipse(model, fixed_in=fixed_in, to=to)
    return MeasuredPair(
        object="block",
        plate="plate",
        mu_1=mu_1,
        mu_2=mu_2,
        axis_rad=axis,
        fixed_in=fixed_in,
        scatter=model.scatter,
        remarks=("These numbers are a model's, which `station diagnose` found or somebody wrote.",),
    )


def _acts_beyond(model: Model, term: Term) -> bool:
    """Returns true if a term acts other than by friction, or by a friction that depends on more than the direction."""
    alone = replace(model, terms=(term,))
    if term.effect.is_null(term.values):
        return False
    if term.effect.acts_through() - {"friction"}:
        return True
    return any(np.ptp(alone.friction(_anywhere(way))) > _EQUAL * model.mu_s for way in _WAYS[::12])


def _anywhere(way_rad: float) -> Contact:
    """Returns blocks that slide, or would, in one direction of P, and differ in all else but their heading."""
    rng = np.random.default_rng(_SEED)
    moving = rng.random(_STATES) < 0.5
    return contact(
        way_rad=way_rad,
        moving=moving,
        run=np.floor(rng.uniform(0, 500, _STATES)),
        speed_m_s=np.where(moving, 10 ** rng.uniform(-4, 0, _STATES), 0.0),
        x_m=rng.uniform(-0.05, 0.05, _STATES),
        y_m=rng.uniform(-0.05, 0.05, _STATES),
        rest_s=10 ** rng.uniform(-2, 4, _STATES),
        slid_s=np.where(moving, rng.uniform(0, 1, _STATES), 0.0),
        tilt_rad=rng.uniform(0.05, 1.2, _STATES),
        down_rad=rng.uniform(-np.pi, np.pi, _STATES),
        rate_rad_s=rng.normal(0, 0.1, (_STATES, 3)),
        rising=rng.choice([-1.0, 1.0], _STATES),
        gone_rad=rng.uniform(0.0, 1.2, _STATES),
        swing_rad=rng.uniform(1.2, 1.4, (_STATES, SWINGS)),
        step_s=rng.uniform(0, 5, _STATES),
        mass_kg=10 ** rng.uniform(-3, 0, _STATES),
        area_m2=10 ** rng.uniform(-4.5, -3, _STATES),
        temperature_c=rng.uniform(5, 35, _STATES),
        relative_humidity=rng.uniform(0.1, 0.9, _STATES),
    )


def _varies(model: Model, **by: Array) -> bool:
    return bool(np.ptp(model.friction(contact(**by))) > _EQUAL * model.mu_s)


def _ellipse(model: Model, *, fixed_in: FixedIn, to: str) -> tuple[float, float, float]:
    """Returns the half-axes of the limit curve and the direction of the first.

    The curve of an ellipse is h² = m + c cos 2φ + s sin 2φ.
    """
    turned = contact(yaw_rad=_WAYS, way_rad=_WAYS)
    if fixed_in == "object" and np.ptp(model.friction(turned)) > _EQUAL * model.mu_s:
        raise UserError(f"Expected a grain of the plate or of the object for --format {to}, got both in the model")
    h = model.friction(contact(way_rad=_WAYS))
    mean, cosine, sine = (float(np.mean(h * h * wave)) for wave in (1.0, 2 * np.cos(2 * _WAYS), 2 * np.sin(2 * _WAYS)))
    fitted = np.sqrt(mean + cosine * np.cos(2 * _WAYS) + sine * np.sin(2 * _WAYS))
    if np.abs(fitted - h).max() > _EQUAL * model.mu_s:
        raise UserError(
            f"Expected a circle or an ellipse of friction for --format {to}, got another curve; "
            "export to a format of Python (numpy, mujoco-python, pybullet, drake)"
        )
    size = math.hypot(cosine, sine)
    mu_1, mu_2 = math.sqrt(mean + size), math.sqrt(max(mean - size, 0.0))
    return (mu_1, mu_2, 0.5 * math.atan2(sine, cosine)) if size > _EQUAL * mean else (mu_1, mu_1, 0.0)

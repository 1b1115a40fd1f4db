"""Contacts and views in great variety, for asking any effect; their arrays refuse to be written to."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np

from station.physics.contact import Array, Contact, View
from station.physics.effect import HOOKS, Effect, Values
from station.physics.reversals import SWINGS

IMAGE_HOOKS = frozenset({"seen"})
NEUTRAL = {name: 1.0 if name == "friction" else 0.0 for name in HOOKS}


def contacts(count: int = 60, *, seed: int = 1, **fixed: Any) -> Contact:
    """Blocks at rest and in motion, everywhere on the plate and in its foam; `fixed` sets a quantity of all."""
    rng = np.random.default_rng(seed)
    moving = rng.random(count) < 0.6
    speed = np.where(moving, 10 ** rng.uniform(-5, 0, count), 0.0)
    turning = rng.normal(0, 1, (2, count, 3))
    values: dict[str, Any] = {
        "run": np.floor(rng.uniform(0, 500, count)),
        "moving": moving,
        "way_rad": rng.uniform(-np.pi, np.pi, count),
        "speed_m_s": speed,
        "x_m": rng.uniform(-0.06, 0.06, count),
        "y_m": rng.uniform(-0.06, 0.06, count),
        "yaw_rad": rng.uniform(-np.pi, np.pi, count),
        "rest_s": 10 ** rng.uniform(-3, 4, count),
        "slid_s": np.where(moving, rng.uniform(0, 1, count), 0.0),
        "tilt_rad": rng.uniform(0, 1.4, count),
        "down_rad": rng.uniform(-np.pi, np.pi, count),
        "rate_rad_s": 0.1 * turning[0],
        "acceleration_rad_s2": turning[1],
        "rising": rng.choice([-1.0, 1.0], count),
        "gone_rad": 0.002 + 1.19 * rng.uniform(0.0, 1.0, count) ** 4,  # many have just turned round
        "swing_rad": rng.uniform(1.2, 1.4, (count, SWINGS)),
        "step_s": rng.uniform(0, 5, count),
        "mount_rad": rng.choice([0.0, np.pi / 4, np.pi / 2, np.pi], count),
        "mass_kg": 10 ** rng.uniform(-3, 0, count),
        "area_m2": 10 ** rng.uniform(-4.5, -3, count),
        "border_m": np.where(rng.random(count) < 0.1, np.inf, rng.uniform(-0.01, 0.03, count)),
        "temperature_c": np.full(count, np.nan),
        "relative_humidity": np.full(count, np.nan),
        "spare_m_s2": rng.uniform(-0.1, 0.5, count),
    }
    for name, value in fixed.items():
        values[name] = np.broadcast_to(np.asarray(value), values[name].shape)
    return Contact(**{name: read_only(value) for name, value in values.items()})


def views(count: int = 60, *, seed: int = 2, on_block: bool = True, **fixed: Any) -> View:
    """Marks of a block, or fiducials, everywhere in the picture."""
    rng = np.random.default_rng(seed)
    side, yaw = 0.02, rng.uniform(-np.pi, np.pi, count)
    square = 0.5 * side * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    turn = np.stack([np.stack([np.cos(yaw), -np.sin(yaw)], -1), np.stack([np.sin(yaw), np.cos(yaw)], -1)], 1)
    moving = (rng.random(count) < 0.5) & on_block
    values: dict[str, Any] = {
        "point_m": rng.uniform(-0.04, 0.04, (count, 1, 2)) + np.einsum("nij,cj->nci", turn, square),
        "velocity_m_s": rng.normal(0, 0.2, (count, 2)) * moving[:, None],
        "yaw_rate_rad_s": rng.normal(0, 3, count) * moving,
        "tilt_rad": rng.uniform(0, 1.4, count),
        "down_rad": rng.uniform(-np.pi, np.pi, count),
        "rest_s": rng.uniform(0, 200, count),
        "limit_rad": np.where(np.arange(count) % 3, 0.4, np.nan),
        "image_centre_m": np.array([0.002, -0.001]),
        "row_m": np.array([0.0, -1.0]),
        **fixed,
    }
    arrays = {name: read_only(np.asarray(value, dtype=float)) for name, value in values.items()}
    return View(on_block=on_block, side_m=side, camera_height_m=0.3, image_size_m=0.1, **arrays)


def read_only(value: Any) -> Any:
    """A copy of an array that cannot be written to."""
    copy = np.array(value)
    copy.flags.writeable = False
    return copy


def some_of(state: Any, chosen: Array) -> Any:
    """The chosen moments of a contact or a view."""
    count = len(state.tilt_rad)
    kept = {
        spec.name: getattr(state, spec.name)[chosen]
        for spec in fields(state)
        if np.ndim(getattr(state, spec.name)) and len(getattr(state, spec.name)) == count
    }
    return replace(state, **kept)


def answer(effect: Effect, hook: str, values: Values, state: Any = None) -> Array:
    """Returns what one of an effect's methods says of many contacts or views, as an array (None as 0)."""
    if hook == "delay_s":
        return np.array(effect.delay_s(values))
    asked = (views() if hook in IMAGE_HOOKS else contacts()) if state is None else state
    said = getattr(effect, hook)(asked, values)
    count = len(asked.tilt_rad)
    shape = {
        "push": (count, 3),
        "mass": (count, 3),
        "attitude": (count, 3),
        "motion": (count, 2, 3),
        "creep": (count, 2),
        "seen": (count, 4, 2),
    }.get(hook, (count,))
    assert said is None or np.shape(said) in {shape, ()}, f"{hook} answered with the shape {np.shape(said)}"
    return np.broadcast_to(np.zeros(shape) if said is None else np.asarray(said, dtype=float), shape)


def typical(effect: Effect) -> dict[str, float]:
    """Values at which the effect is plain to see."""
    plain = effect.neutral()
    return plain | {one.name: one.clipped(one.null + one.typical) for one in effect.parameters if one.null is not None}

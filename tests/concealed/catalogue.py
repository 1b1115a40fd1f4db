"""The effects that can be concealed: how each is set, drawn and seen. Identifiers are those of the catalogue.

An effect's strength is one number; `draw` chooses everything else about it (axes, places, shapes) and says which of the
world's parameters the number multiplies.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from numpy.random import Generator

from tests.concealed.world import World

Fields = dict[str, float]
Draw = Callable[[Generator], tuple[Fields, Fields]]
"""Fixed values of the world's parameters, and the parameters that the strength multiplies, with their factors."""


@dataclass(frozen=True, kw_only=True)
class Effect:
    """One effect.

    `nominal` is a usual value and `cap` the largest that still is physics (in `unit`); `needs` are the features of a
    protocol that tell it from its likes; `places` are where it shows, phase and covariate, the surest first.
    """

    id: str
    unit: str
    nominal: float
    cap: float
    draw: Draw
    places: tuple[tuple[str, str], ...]
    needs: tuple[str, ...] = ()
    in_catalogue: bool = True
    onset_only: bool = False
    """Its strength is judged by the onsets alone, because its path is that of another effect."""


@dataclass(frozen=True, kw_only=True)
class Planted:
    """An effect with everything about it drawn but its strength."""

    effect: Effect
    fixed: Fields
    scaled: Fields

    def apply(self, world: World, value: float) -> World:
        """The world with this effect at a strength in the effect's unit."""
        return world._replace(**self.fields(world, value))

    def fields(self, world: World, value: float) -> Fields:
        """The world's parameters, in their own units, at a strength in the effect's unit."""
        weight = world.load_reference_n
        factors = {name: factor * (weight if name == "adhesion_n" else 1.0) for name, factor in self.scaled.items()}
        return {**self.fixed, **{name: factor * value for name, factor in factors.items()}}


def plant(effect: Effect, rng: Generator) -> Planted:
    """Draws everything about an effect but its strength."""
    fixed, scaled = effect.draw(rng)
    return Planted(effect=effect, fixed=fixed, scaled=scaled)


def _only(name: str, **fixed: float) -> Draw:
    return lambda _: (dict(fixed), {name: 1.0})


def _either(rng: Generator) -> float:
    return float(rng.integers(2))


def _sign(rng: Generator, *, negative: float) -> float:
    return -1.0 if rng.random() < negative else 1.0


def _axis(rng: Generator, *, full: bool) -> float:
    return float(rng.uniform(0.0, 2.0 * math.pi if full else math.pi))


def _stribeck(rng: Generator) -> tuple[Fields, Fields]:
    return {"fall_speed": float(rng.uniform(0.012, 0.05)), "fall_shape": _either(rng)}, {"fall": 1.0}


def _rate(rng: Generator) -> tuple[Fields, Fields]:
    return {"rate_speed": float(rng.uniform(0.001, 0.005))}, {"rate_gain": 1.0}


def _ageing(rng: Generator) -> tuple[Fields, Fields]:
    return {"ageing_cutoff_s": float(rng.uniform(0.02, 0.2)), "ageing_shape": _either(rng)}, {"ageing": 1.0}


def _wear(rng: Generator) -> tuple[Fields, Fields]:
    shape = _either(rng)
    runs = float(rng.uniform(15.0, 80.0)) if shape == 0.0 else 100.0
    return {"wear_runs": runs, "wear_shape": shape}, {"wear": _sign(rng, negative=0.25 if shape == 1.0 else 0.0)}


def _grain(where: str) -> Draw:
    def draw(rng: Generator) -> tuple[Fields, Fields]:
        fixed = {f"grain_{where}_axis": _axis(rng, full=False), f"grain_{where}_shape": _either(rng)}
        return fixed, {f"grain_{where}": 1.0}

    return draw


def _nap(rng: Generator) -> tuple[Fields, Fields]:
    where = "plate" if rng.random() < 0.6 else "object"
    return {f"nap_{where}_axis": _axis(rng, full=True)}, {f"nap_{where}": 1.0}


def _patch(rng: Generator) -> tuple[Fields, Fields]:
    shape = _either(rng)
    turn, reach = _axis(rng, full=True), float(rng.uniform(0.004, 0.016))
    fixed = {
        "patch_x": reach * math.cos(turn), "patch_y": reach * math.sin(turn),
        "patch_radius": float(rng.uniform(0.009, 0.015)), "patch_shape": shape,
    }  # fmt: skip
    return fixed, {"patch": _sign(rng, negative=0.5)}


def _vector(x: str, y: str) -> Draw:
    def draw(rng: Generator) -> tuple[Fields, Fields]:
        turn = _axis(rng, full=True)
        return {}, {x: math.cos(turn), y: math.sin(turn)}

    return draw


def _shake(rng: Generator) -> tuple[Fields, Fields]:
    return {"shake_axis": _axis(rng, full=True), "shake_hz": float(rng.uniform(3.0, 8.0))}, {"shake": 1.0}


def _magnet(rng: Generator) -> tuple[Fields, Fields]:
    turn, reach = _axis(rng, full=True), float(rng.uniform(0.008, 0.02))
    fixed = {"magnet_x": reach * math.cos(turn), "magnet_y": reach * math.sin(turn)}
    return fixed | {"magnet_radius": float(rng.uniform(0.012, 0.02))}, {"magnet": 1.0}


def _tide(rng: Generator) -> tuple[Fields, Fields]:
    return {"tide_s": float(rng.uniform(250.0, 500.0)), "tide_phase": _axis(rng, full=True)}, {"tide": 1.0}


_CONTACT = (
    Effect(
        id="kinetic_drop", unit="share of mu_s", nominal=0.05, cap=0.5, draw=_only("drop"),
        places=(("slide", "speed"), ("slide", "time"), ("stop", "speed")),
    ),
    Effect(
        id="stribeck", unit="share of mu_s", nominal=0.05, cap=0.5, draw=_stribeck,
        places=(("slide", "speed"), ("stop", "speed")),
    ),
    Effect(
        id="rate_strengthening", unit="share of mu per e-fold", nominal=0.01, cap=0.15, draw=_rate,
        places=(("slide", "speed"), ("stop", "speed")),
    ),
    Effect(
        id="viscous", unit="1/s", nominal=0.3, cap=15.0, draw=_only("drag_per_s"),
        places=(("slide", "speed"), ("stop", "speed")),
    ),
    Effect(
        id="contact_aging", unit="share of mu_s per decade (shape 1: its logarithm)", nominal=0.03, cap=0.2,
        draw=_ageing, needs=("dwell",),
        onset_only=True,
        places=(("onset", "dwell"),),
    ),
    Effect(
        id="wear", unit="share of mu (at the end, or in 100 runs)", nominal=0.05, cap=0.4, draw=_wear,
        places=(("onset", "run"), ("slide", "run")),
    ),
    Effect(
        id="object_anisotropy", unit="ln of the ellipse's ratio", nominal=0.08, cap=0.69, draw=_grain("object"),
        needs=("yaw", "free"), places=(("onset", "yaw"), ("onset", "direction"), ("slide", "yaw")),
    ),
    Effect(
        id="plate_anisotropy", unit="ln of the ellipse's ratio", nominal=0.08, cap=0.69, draw=_grain("plate"),
        needs=("yaw", "free"), places=(("onset", "direction"), ("slide", "direction")),
    ),
    Effect(
        id="one_way_friction", unit="share of mu", nominal=0.04, cap=0.3, draw=_nap, needs=("yaw", "mounts", "free"),
        places=(("onset", "direction"), ("onset", "yaw"), ("slide", "direction")),
    ),
    Effect(
        id="friction_patch", unit="share of mu", nominal=0.1, cap=0.7, draw=_patch, needs=("replace",),
        places=(("onset", "position"), ("slide", "position")),
    ),
    Effect(
        id="adhesion", unit="weights of the block", nominal=0.05, cap=1.0, draw=_only("adhesion_n"), needs=("masses",),
        places=(("onset", "load"), ("slide", "load")),
    ),
    Effect(
        id="load_dependence", unit="1", nominal=0.05, cap=0.45, draw=_only("load_power"), needs=("masses",),
        places=(("onset", "load"), ("slide", "load")),
    ),
    Effect(
        id="presliding", unit="m", nominal=2e-5, cap=1e-3,
        draw=lambda rng: ({"presliding_shape": _either(rng)}, {"presliding_m": 1.0}),
        places=(("pre-slip", "tilt"), ("pre-slip", "time")),
    ),
    Effect(
        id="uneven_contact", unit="m", nominal=1e-4, cap=2.5e-3, draw=_vector("uneven_x", "uneven_y"), needs=("yaw",),
        places=(("slide", "yaw"), ("onset", "yaw")),
    ),
    Effect(
        id="border_contact", unit="1/s^2", nominal=100.0, cap=4e4,
        draw=lambda rng: ({"foam_damping_s": float(rng.uniform(0.002, 0.01))}, {"foam_per_s2": 1.0}), needs=("border",),
        places=(("stop", "position"), ("slide", "position")),
    ),
)  # fmt: skip
_RIG = (
    Effect(
        id="platform_level", unit="rad", nominal=0.005, cap=0.06, draw=_vector("level_x", "level_y"),
        needs=("yaw", "mounts", "free"), places=(("onset", "direction"), ("slide", "direction")),
    ),
    Effect(
        id="angle_scale", unit="1", nominal=0.01, cap=0.1, draw=lambda rng: ({}, {"scale": _sign(rng, negative=0.5)}),
        needs=("sensor",), places=(("pre-slip", "tilt"), ("onset", "tilt")),
    ),
    Effect(
        id="backlash", unit="rad", nominal=0.004, cap=0.04, draw=_only("play"), needs=("sensor",),
        places=(("stop", "tilt"), ("pre-slip", "tilt")),
    ),
    Effect(
        id="pivot_offset", unit="m (pivot above the block)", nominal=0.02, cap=0.4,
        draw=lambda _: ({}, {"pivot_height": -1.0}), needs=("rates",),
        places=(("onset", "step"), ("onset", "tilt_rate"), ("slide", "tilt_rate")),
    ),
    Effect(
        id="arm_vibration", unit="m/s^2", nominal=0.3, cap=2.0, draw=_shake, onset_only=True,
        places=(("onset", "direction"), ("onset", "step")),
    ),
    Effect(
        id="clock_offset", unit="s", nominal=0.02, cap=0.25, needs=("rates",),
        draw=lambda rng: ({}, {"late_s": _sign(rng, negative=0.5)}),
        places=(("onset", "tilt_rate"), ("pre-slip", "tilt_rate")),
    ),
)  # fmt: skip
_CAMERA = (
    Effect(
        id="camera_sag", unit="px", nominal=2.0, cap=40.0, draw=_only("sag_px"),
        places=(("pre-slip", "tilt"), ("pre-slip", "direction")),
    ),
    Effect(
        id="lens_distortion", unit="1", nominal=0.002, cap=0.06,
        draw=lambda rng: ({}, {"lens": _sign(rng, negative=0.5)}), needs=("replace",),
        places=(("rest", "position"), ("slide", "position")),
    ),
    Effect(
        id="rolling_shutter", unit="s", nominal=0.003, cap=0.03, draw=_only("readout_s"),
        places=(("slide", "speed"), ("slide", "direction")),
    ),
)  # fmt: skip
_BEYOND = (
    Effect(
        id="magnetic_pull", unit="m/s^2", nominal=0.2, cap=3.0, draw=_magnet, needs=("replace",), in_catalogue=False,
        places=(("onset", "position"), ("slide", "position"), ("onset", "direction")),
    ),
    Effect(
        id="humidity_coupling", unit="share of mu per 10 %", nominal=0.05, cap=0.4, in_catalogue=False,
        draw=lambda rng: ({}, {"damp": _sign(rng, negative=0.3)}),
        places=(("onset", "humidity"), ("onset", "run"), ("slide", "humidity")),
    ),
    Effect(
        id="charge_up", unit="g of extra press", nominal=0.06, cap=0.6, in_catalogue=False, needs=("replace",),
        onset_only=True, draw=lambda rng: ({"charge_slides": float(rng.uniform(3.0, 8.0))}, {"charge": 1.0}),
        places=(("onset", "run"), ("slide", "run"), ("onset", "slides_since_handled")),
    ),
    Effect(
        id="slide_length_memory", unit="share of mu per 4 mm", nominal=0.03, cap=0.25, in_catalogue=False,
        draw=lambda rng: ({}, {"echo_length": _sign(rng, negative=0.5)}),
        places=(("onset", "previous_length"), ("onset", "run"), ("slide", "previous_length")),
    ),
    Effect(
        id="direction_memory", unit="share of mu", nominal=0.04, cap=0.3, in_catalogue=False,
        draw=lambda rng: ({}, {"echo_direction": _sign(rng, negative=0.5)}),
        places=(("onset", "previous_direction"), ("onset", "direction"), ("slide", "previous_direction")),
    ),
    Effect(
        id="plate_bending", unit="1/m", nominal=1.0, cap=12.0, in_catalogue=False, needs=("replace",),
        draw=lambda rng: ({}, {"bend_per_m": _sign(rng, negative=0.5)}),
        places=(("onset", "position"), ("slide", "position"), ("onset", "direction")),
    ),
    Effect(
        id="slow_tide", unit="share of mu", nominal=0.04, cap=0.35, draw=_tide, in_catalogue=False,
        places=(("onset", "run"), ("onset", "time"), ("slide", "run")),
    ),
    Effect(
        id="lift_at_speed", unit="share of the normal force", nominal=0.1, cap=0.9, in_catalogue=False,
        draw=lambda rng: ({"lift_speed": float(rng.uniform(0.05, 0.12))}, {"lift": 1.0}),
        places=(("slide", "speed"), ("stop", "speed")),
    ),
    Effect(
        id="fourfold_texture", unit="share of mu", nominal=0.04, cap=0.06, in_catalogue=False, needs=("free",),
        draw=lambda rng: ({"fourfold_axis": float(rng.uniform(0.0, 0.5 * math.pi))}, {"fourfold": 1.0}),
        places=(("onset", "direction"), ("slide", "direction")),
    ),
)  # fmt: skip

EFFECTS = {effect.id: effect for effect in (*_CONTACT, *_RIG, *_CAMERA)}
BEYOND = {effect.id: effect for effect in _BEYOND}
TIPPING = Effect(
    id="tipping", unit="rad of tilt at which it tips", nominal=0.35, cap=math.inf, draw=_only("tips_at"),
    places=(("onset", "tilt"), ("onset", "direction")),
)  # fmt: skip
"""Needs a taller block, which the rig file tells, and so is set apart."""

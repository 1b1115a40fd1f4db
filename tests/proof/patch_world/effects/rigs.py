"""Effects of the rig: level, scale, gears, pivot, shaking, clocks, mast, lens and shutter."""

from __future__ import annotations

from dataclasses import replace
from math import cos, radians, sin

import numpy as np

from tests.proof.patch_world.effects.base import Effect, axis, camera, contact, sensing, sign
from tests.proof.patch_world.world import World


def _lean(world: World, strength: float, rng: np.random.Generator) -> World:
    where = axis(rng)
    return contact(world, lean_x=radians(strength) * cos(where), lean_y=radians(strength) * sin(where))


def _scale(world: World, strength: float, rng: np.random.Generator) -> World:
    share, way = rng.uniform(0.3, 0.7), sign(rng)
    # Partly a gain (at 20°), partly an offset.
    return sensing(world, gain=1 + way * share * strength / 20.0, offset_rad=radians(way * (1 - share) * strength))


def _play(world: World, strength: float, _: np.random.Generator) -> World:
    return contact(world, play=radians(strength))


def _pivot(world: World, strength: float, rng: np.random.Generator) -> World:
    way = rng.standard_normal(3) * (0.3, 0.3, 1.0)
    x, y, z = strength * way / np.linalg.norm(way)
    return contact(world, pivot_x=float(x), pivot_y=float(y), pivot_z=float(z))


def _shaking(world: World, strength: float, rng: np.random.Generator) -> World:
    tones: list[tuple[float, float, float, float]] = []
    for _ in range(5):
        hertz, phase = float(rng.uniform(6.0, 35.0)), axis(rng)
        x, y = strength * rng.standard_normal(2) / np.sqrt(5)
        tones.append((hertz, float(x), float(y), phase))
    return replace(world, tones=tuple(tones))


def _stamps(world: World, strength: float, _: np.random.Generator) -> World:
    return sensing(world, stamp_s=strength)


def _mast(world: World, strength: float, rng: np.random.Generator) -> World:
    along = bool(rng.random() < 0.5)
    return camera(world, bend_px=strength * (1.0 if along else sign(rng)), bend_along=along, bend_axis=axis(rng))


def _barrel(world: World, strength: float, rng: np.random.Generator) -> World:
    return camera(world, radial=-sign(rng) * strength)


def _shutter(world: World, strength: float, rng: np.random.Generator) -> World:
    return camera(world, readout_s=sign(rng) * strength)


RIGS = (
    Effect(
        id="leaning_base", catalogue="platform_level", most=4.0, unit="degrees",
        meaning="the plate that is called level leans", change=_lean,
    ),
    Effect(
        id="false_protractor", catalogue="angle_scale", most=4.0, unit="degrees at a tilt of 20°",
        meaning="the arm's angles have a gain and an offset", change=_scale,
    ),
    Effect(
        id="loose_gear", catalogue="backlash", most=2.0, unit="degrees of half the play",
        meaning="the plate stays behind when the motion turns round", change=_play,
    ),
    Effect(
        id="far_pivot", catalogue="pivot_offset", most=0.4, unit="m",
        meaning="the plate truly turns about a point far from the stated one", change=_pivot,
    ),
    Effect(
        id="shaking_arm", catalogue="arm_vibration", most=1.0, unit="m/s² (root mean square, each way)",
        meaning="five tones of 6 to 35 Hz shake the plate in its plane", change=_shaking,
    ),
    Effect(
        id="early_stamps", catalogue="clock_offset", most=0.15, unit="s",
        meaning="the arm's stamps lie before the moments of its attitudes", change=_stamps,
    ),
    Effect(
        id="bending_mast", catalogue="camera_sag", most=20.0, unit="px at a vertical plate",
        meaning="the camera's mast bends with the tilt, along the slope or one way", change=_mast,
    ),
    Effect(
        id="barrel_lens", catalogue="lens_distortion", most=3.0, unit="coefficient of r² (r in focal lengths)",
        meaning="a lens that nobody calibrated", change=_barrel,
    ),
    Effect(
        id="row_readout", catalogue="rolling_shutter", most=0.02, unit="s from the first row to the last",
        meaning="rows are exposed one after another, and nobody says so", change=_shutter,
    ),
)  # fmt: skip

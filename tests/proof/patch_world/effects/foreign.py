"""Effects that the tool's catalogue does not have."""

from __future__ import annotations

import numpy as np

from tests.proof.patch_world.effects.base import Effect, axis, camera, contact, history, sign
from tests.proof.patch_world.world import World

NONE = "none"


def _weight(world: World) -> float:
    return world.contact.mass * world.contact.gravity


def _magnet(world: World, strength: float, rng: np.random.Generator) -> World:
    x, y = rng.uniform(-0.015, 0.015, 2)
    reach = float(rng.uniform(0.01, 0.018))
    return contact(world, magnet_n=strength * _weight(world), magnet_x=float(x), magnet_y=float(y), magnet_reach=reach)


def _thread(world: World, strength: float, rng: np.random.Generator) -> World:
    x, y = rng.uniform(-0.01, 0.01, 2)
    return contact(world, thread_n_m=strength * _weight(world) / 0.02, thread_x=float(x), thread_y=float(y))


def _gusts(world: World, strength: float, rng: np.random.Generator) -> World:
    period, share = float(rng.uniform(45.0, 110.0)), float(rng.uniform(0.3, 0.6))
    return contact(world, gust_n=strength * _weight(world), gust_axis=axis(rng), gust_period=period, gust_share=share)


def _cycle(world: World, strength: float, rng: np.random.Generator) -> World:
    return history(world, cycle=strength, cycle_s=float(rng.uniform(250.0, 500.0)), cycle_phase=axis(rng))


def _memory(world: World, strength: float, rng: np.random.Generator) -> World:
    return history(world, memory=sign(rng) * strength)


def _dust(world: World, strength: float, rng: np.random.Generator) -> World:
    return history(world, dust_share=float(rng.uniform(0.15, 0.35)), dust_drop=strength)


def _slosh(world: World, strength: float, rng: np.random.Generator) -> World:
    hertz, damping = float(rng.uniform(1.0, 2.5)), float(rng.uniform(0.03, 0.15))
    return contact(world, slosh_share=strength, slosh_omega=2 * np.pi * hertz, slosh_damping=damping)


def _rupture(world: World, strength: float, _: np.random.Generator) -> World:
    return contact(world, fatigue=strength)


def _slip(world: World, strength: float, rng: np.random.Generator) -> World:
    run, where = int(rng.integers(15, 45)), axis(rng)  # one of the 60 of a session in `tests.proof`, or of more
    return camera(
        world, slip_run=run, slip_x_px=strength * float(np.cos(where)), slip_y_px=strength * float(np.sin(where))
    )


FOREIGN = (
    Effect(
        id="magnet", catalogue=NONE, most=0.25, unit="greatest pull over the weight",
        meaning="a magnet under the plate draws the block to a place", change=_magnet,
    ),
    Effect(
        id="thread", catalogue=NONE, most=0.25, unit="pull at 20 mm over the weight",
        meaning="an elastic thread ties the block to a point of the plate", change=_thread,
    ),
    Effect(
        id="gusts", catalogue=NONE, most=0.2, unit="push over the weight",
        meaning="a fan that runs from time to time pushes the block one way", change=_gusts,
    ),
    Effect(
        id="warm_cold", catalogue=NONE, most=0.25, unit="relative amplitude",
        meaning="friction follows the room's heating, up and down over the session", change=_cycle,
    ),
    Effect(
        id="laid_nap", catalogue=NONE, most=0.25, unit="relative, along the last slide",
        meaning="the last slide lays the surface: friction depends on the way of the run before", change=_memory,
    ),
    Effect(
        id="dust_grain", catalogue=NONE, most=0.3, unit="relative drop in the runs that have a grain",
        meaning="in some runs a grain lies under one corner, which takes most of the load", change=_dust,
    ),
    Effect(
        id="inner_mass", catalogue=NONE, most=0.7, unit="share of the mass",
        meaning="a part of the block's mass swings inside it on a spring", change=_slosh,
    ),
    Effect(
        id="delayed_rupture", catalogue=NONE, most=1.5, unit="relative loss per second near the full load",
        meaning="contacts that are held near their strength give way with time", change=_rupture,
    ),
    Effect(
        id="slipped_camera", catalogue=NONE, most=12.0, unit="px",
        meaning="the camera's mount slips once in the session", change=_slip,
    ),
)  # fmt: skip

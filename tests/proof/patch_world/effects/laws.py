"""Effects of the law of friction: of speed, of slip, and of the time at rest."""

from __future__ import annotations

import numpy as np

from tests.proof.patch_world.effects.base import Effect, contact
from tests.proof.patch_world.world import World


def _weakening(world: World, strength: float, rng: np.random.Generator) -> World:
    speed, exponent = float(np.exp(rng.uniform(np.log(0.008), np.log(0.05)))), float(rng.uniform(0.8, 2.0))
    return contact(world, weak_drop=strength, weak_speed=speed, weak_exponent=exponent)


def _peak(world: World, strength: float, rng: np.random.Generator) -> World:
    return contact(world, slip_drop=strength, slip_length=float(np.exp(rng.uniform(np.log(1e-5), np.log(8e-5)))))


def _direct(world: World, strength: float, rng: np.random.Generator) -> World:
    return contact(world, direct=strength, direct_speed=float(np.exp(rng.uniform(np.log(3e-4), np.log(3e-3)))))


def _film(world: World, strength: float, _: np.random.Generator) -> World:
    # One unit is the drag that takes 1 m/s² at 0.1 m/s from this block.
    return contact(world, film=10.0 * strength * world.contact.mass)


def _healing(world: World, strength: float, rng: np.random.Generator) -> World:
    return contact(world, age_gain=strength, age_time=float(rng.uniform(0.05, 0.4)))


def _soft(world: World, strength: float, _: np.random.Generator) -> World:
    # The elastic give of the sole just before it slips (m); the damping keeps its ratio.
    stiffness = world.contact.mu / strength
    ratio = (stiffness / world.contact.stiffness) ** 0.5
    return contact(world, stiffness=stiffness, damping=world.contact.damping * ratio)


LAWS = (
    Effect(
        id="velocity_weakening", catalogue="stribeck", also=("kinetic_drop",), most=0.5,
        unit="share of the static friction lost",
        meaning="friction falls with speed (Bo and Pavelka's exponent)", change=_weakening,
    ),
    Effect(
        id="slip_weakening", catalogue="kinetic_drop", also=("stribeck",), most=0.5,
        unit="share of the static friction lost",
        meaning="the junctions break over some micrometres of slip, and heal at rest", change=_peak,
    ),
    Effect(
        id="direct_effect", catalogue="rate_strengthening", most=0.08, unit="relative rise per asinh(v / 2 v0)",
        meaning="friction rises with the logarithm of speed (rate and state, direct effect)", change=_direct,
    ),
    Effect(
        id="oil_film", catalogue="viscous", most=6.0, unit="m/s² at 0.1 m/s",
        meaning="a film of oil drags in proportion to speed",
        change=_film,
    ),
    Effect(
        id="healing", catalogue="contact_aging", most=0.12, shows="onset", unit="relative rise per decade of age",
        meaning="resting contacts age, and are renewed by slip (Dieterich)", change=_healing,
    ),
    Effect(
        id="soft_sole", catalogue="presliding", most=1.5e-3, unit="m of elastic give at the strength",
        meaning="the bristles are soft: the block gives before it slips", change=_soft,
    ),
)  # fmt: skip

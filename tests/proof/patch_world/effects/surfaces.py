"""Effects of the two surfaces: grain, nap, worn spots, a worn corner, polish, and foam that throws back or clings."""

from __future__ import annotations

import numpy as np

from tests.proof.patch_world.effects.base import Effect, axis, contact, history, patch, sign
from tests.proof.patch_world.world import World


def _brushed(world: World, strength: float, rng: np.random.Generator) -> World:
    return contact(world, plate_ratio=strength, plate_axis=0.5 * axis(rng))


def _fibres(world: World, strength: float, rng: np.random.Generator) -> World:
    return contact(world, sole_ratio=strength, sole_axis=0.5 * axis(rng))


def _plate_nap(world: World, strength: float, rng: np.random.Generator) -> World:
    return contact(world, plate_nap=strength, plate_nap_axis=axis(rng))


def _sole_nap(world: World, strength: float, rng: np.random.Generator) -> World:
    return contact(world, sole_nap=strength, sole_nap_axis=axis(rng))


def _spots(world: World, strength: float, rng: np.random.Generator) -> World:
    count = int(rng.integers(2, 5))
    places = rng.uniform(-0.03, 0.03, (count, 2))
    radii, change = rng.uniform(0.006, 0.014, count), sign(rng) * strength
    rows = [(float(x), float(y), float(r), change) for (x, y), r in zip(places, radii, strict=True)]
    return patch(world, spots=tuple(rows))


def _field(world: World, strength: float, rng: np.random.Generator) -> World:
    length = float(rng.uniform(0.012, 0.03))
    return patch(world, field_sd=strength, field_length_m=length, field_seed=int(rng.integers(1 << 30)))


def _corner(world: World, strength: float, rng: np.random.Generator) -> World:
    where = axis(rng)
    return patch(world, lopsided=(strength * float(np.cos(where)), strength * float(np.sin(where))))


def _polish(world: World, strength: float, rng: np.random.Generator) -> World:
    return history(world, polish=sign(rng) * strength, polish_runs=float(rng.uniform(20.0, 60.0)))


def _foam(world: World, strength: float, rng: np.random.Generator) -> World:
    # A crumbling edge reaches inwards and yields; it holds and throws back what touches it.
    return contact(
        world,
        wall_radius=world.contact.wall_radius - strength,
        wall_stiffness=float(rng.uniform(10.0, 40.0)),
        wall_return=0.9,
    )


SURFACES = (
    Effect(
        id="brushed_plate", catalogue="plate_anisotropy", most=0.3, unit="relative, along against across",
        meaning="an elliptic limit curve fixed in the plate", change=_brushed,
    ),
    Effect(
        id="fibrous_sole", catalogue="object_anisotropy", most=0.3, unit="relative, along against across",
        meaning="an elliptic limit curve fixed in the sole", change=_fibres,
    ),
    Effect(
        id="plate_nap", catalogue="one_way_friction", most=0.3, unit="relative, with against across the nap",
        meaning="friction that is lower one way than the other, fixed in the plate", change=_plate_nap,
    ),
    Effect(
        id="sole_nap", catalogue="one_way_friction", most=0.3, unit="relative, with against across the nap",
        meaning="friction that is lower one way than the other, fixed in the sole", change=_sole_nap,
    ),
    Effect(
        id="worn_spots", catalogue="friction_patch", most=0.5, unit="relative in a spot's middle",
        meaning="two to four round spots with another friction", change=_spots,
    ),
    Effect(
        id="patchy_plate", catalogue="friction_patch", most=0.3, unit="relative standard deviation",
        meaning="a smooth random field of friction over the plate", change=_field,
    ),
    Effect(
        id="worn_corner", catalogue="uneven_contact", most=0.6, unit="relative, edge against middle",
        meaning="friction that differs over the sole", change=_corner,
    ),
    Effect(
        id="polishing", catalogue="wear", most=0.3, unit="relative change in the end",
        meaning="friction that goes from one level to another over the runs", change=_polish,
    ),
    Effect(
        id="crumbling_foam", catalogue="border_contact", most=0.012, unit="m that the edge reaches inwards",
        meaning="foam that reaches further in than the rig file says, holds and throws back", change=_foam,
    ),
)  # fmt: skip

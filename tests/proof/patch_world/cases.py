"""The cases of a tier: which rig, which nuisances, which effects, and how strong; all of it drawn from the seed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from tests.proof.patch_world.effects import EFFECTS, KNOWN, OUTSIDE
from tests.proof.patch_world.pilot import strength_for
from tests.proof.patch_world.world import Camera, Contact, Scatter, Sensing, World

TIERS = ("null", "null_nuisance", "single", "pair", "outside")
_APART = (
    {"velocity_weakening", "slip_weakening"},
    {"worn_spots", "patchy_plate"},
    {"brushed_plate", "fibrous_sole"},  # the bristles have one limit ellipse
    {"plate_nap", "sole_nap"},
)
"""Pairs whose two effects are one for every purpose, or which the bristles cannot have together."""

_ASKEW_RAD = 0.01
"""The standard deviation of the inclinometer's turn about each axis: it is put on by hand, to about half a degree."""


@dataclass(frozen=True, kw_only=True)
class Hidden:
    """An effect in a case: its strength, and its sizes over the pilot runs (pilot.py)."""

    id: str
    strength: float
    sizes: dict[str, float]


@dataclass(frozen=True, kw_only=True)
class Case:
    """A case: the plain world, the world with all its effects, and the worlds that lack one each."""

    name: str
    tier: str
    seed: int
    plain: World
    world: World
    without: dict[str, World]
    hidden: tuple[Hidden, ...]

    def key(self) -> dict[str, Any]:
        """Returns what the key says of the case."""
        effects = [
            {"effect": one.id, "catalogue": EFFECTS[one.id].catalogue, "also": EFFECTS[one.id].also,
             "strength": one.strength, "unit": EFFECTS[one.id].unit, "sizes": one.sizes}
            for one in self.hidden
        ]  # fmt: skip
        world = {**asdict(self.world), "contact": self.world.contact._asdict()}
        return {"case": self.name, "tier": self.tier, "seed": self.seed, "effects": effects, "world": world}


def draw_ids(tier: str, cases: int, *, seed: int, only: Sequence[str]) -> list[tuple[str, ...]]:
    """The effects of each case: every effect of the tier comes once before one comes again."""
    rng = np.random.default_rng([seed, TIERS.index(tier), 5])
    if tier.startswith("null"):
        return [()] * cases
    choice = list(only) or list(OUTSIDE if tier == "outside" else KNOWN)
    order: list[str] = []
    while len(order) < 2 * cases + len(choice):
        order += [choice[k] for k in rng.permutation(len(choice))]
    if tier != "pair":
        return [(one,) for one in order[:cases]]
    return [_pair(order, rng) for _ in range(cases)]


def _pair(order: list[str], rng: np.random.Generator) -> tuple[str, ...]:
    first = order.pop(0)
    fits = [k for k, other in enumerate(order) if other != first and {first, other} not in _APART]
    return first, order.pop(fits[0] if fits else int(rng.integers(len(order))))


def make_case(name: str, tier: str, ids: Sequence[str], *, seed: int, runs: int) -> Case:
    """A case with these effects."""
    rng = np.random.default_rng([seed, 6])
    plain = plain_world(tier, rng)
    world, hidden = plain, list[Hidden]()
    for k, one in enumerate(ids):
        wanted = math.exp(rng.uniform(math.log(1.5), math.log(3.0)))
        strength, world, found = strength_for(EFFECTS[one], world, seed=seed + k, runs=runs, wanted=wanted)
        hidden.append(Hidden(id=one, strength=strength, sizes=found))
    return _case(name, tier, plain, hidden, seed)


def case_of_key(key: dict[str, Any]) -> Case:
    """The case that the key describes."""
    plain = plain_world(key["tier"], np.random.default_rng([key["seed"], 6]))
    hidden = [Hidden(id=one["effect"], strength=one["strength"], sizes=one["sizes"]) for one in key["effects"]]
    return _case(key["case"], key["tier"], plain, hidden, key["seed"])


def _case(name: str, tier: str, plain: World, hidden: Sequence[Hidden], seed: int) -> Case:
    without = {one.id: _with(plain, [h for h in hidden if h is not one], hidden, seed) for one in hidden}
    world = _with(plain, hidden, hidden, seed)
    return Case(name=name, tier=tier, seed=seed, plain=plain, world=world, without=without, hidden=tuple(hidden))


def _with(plain: World, some: Sequence[Hidden], hidden: Sequence[Hidden], seed: int) -> World:
    """The plain world with some of the case's effects, each as it was drawn."""
    world = plain
    for one in some:
        rng = np.random.default_rng([seed + list(hidden).index(one), 4])
        world = EFFECTS[one.id].change(world, one.strength, rng)
    return world


def plain_world(tier: str, rng: np.random.Generator) -> World:
    """A rig without effects: its block, its scatter, and the nuisances of the tier."""
    half, height = rng.uniform(0.0065, 0.009), rng.uniform(0.005, 0.009)
    contact = Contact()._replace(
        half_x=round(half, 5),
        half_y=round(half, 5),
        height=round(height, 5),
        mass=round(float(rng.uniform(2000.0, 7000.0)) * 4 * half * half * height, 6),
        mu=float(rng.uniform(0.26, 0.46)),
        stiffness=float(rng.uniform(1.5e6, 3e6)),
        ring_hz=float(rng.uniform(10.0, 18.0)),
        ring_damping=float(rng.uniform(0.25, 0.5)),
        pivot_height=round(height, 5) / 2,
    )
    scatter, camera = Scatter(run_sd=float(rng.uniform(0.012, 0.03))), Camera(unseen_share=0.001)
    world = World(contact=contact, scatter=scatter, camera=camera)
    return world if tier == "null" else _with_nuisance(world, rng, strong=tier == "null_nuisance")


def _with_nuisance(world: World, rng: np.random.Generator, *, strong: bool) -> World:
    """Wander of friction, uneven contact, noisy and filtered attitude, a camera with lapses; no effect of any kind."""
    size = float(rng.uniform(0.6, 1.0)) * (1.0 if strong else 0.35)
    scatter = replace(
        world.scatter,
        wander_sd=0.04 * size,
        wander_length_m=float(rng.uniform(0.0015, 0.005)),
        pressure_sd=0.4 * size,
        sole_sd=0.08 * size,
    )
    x, y, z = _ASKEW_RAD * rng.standard_normal(3)
    sensing = Sensing(
        noise_rad=4e-4 * size,
        step_rad=2e-4 * size,
        rate_noise_rad_s=5e-3 * size,
        askew_rad=(float(x), float(y), float(z)),
    )
    camera = Camera(
        pixel_sd=0.04 + 0.04 * size,
        pose_sd_px=0.03 * size,
        outlier_share=0.002 * size,
        unseen_share=0.004 * size,
        skipped_share=0.004 * size,
    )
    contact = world.contact._replace(
        rate_filter=0.04 * size, ring_damping=world.contact.ring_damping * (1 - 0.4 * size)
    )
    return replace(world, contact=contact, scatter=scatter, sensing=sensing, camera=camera)

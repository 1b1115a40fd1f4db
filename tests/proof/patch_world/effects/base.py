"""An effect of this world is a change to its numbers, of a strength in the effect's own unit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tests.proof.patch_world.world import World

Change = Callable[[World, float, np.random.Generator], World]


@dataclass(frozen=True, kw_only=True)
class Effect:
    """An effect. `catalogue` is the id in the tool's catalogue, or "none"; `also` further ids that are as right.

    `most` is the strongest that is physical, in `unit`. `shows` names the one size (pilot.py) by which the strength is
    found, where the largest is of a side effect. `change` gives the world with the effect of a strength; what
    else it needs (an axis, a place) it draws from the generator, in the same order whatever the strength is.
    """

    id: str
    catalogue: str
    meaning: str
    unit: str
    most: float
    change: Change
    also: tuple[str, ...] = ()
    shows: str = ""


def contact(world: World, **numbers: float) -> World:
    """The world with other numbers of its contact."""
    return replace(world, contact=world.contact._replace(**numbers))


def patch(world: World, **values: object) -> World:
    """The world with another patch."""
    return replace(world, patch=replace(world.patch, **values))  # pyright: ignore[reportArgumentType]


def history(world: World, **values: float) -> World:
    """The world with another history."""
    return replace(world, history=replace(world.history, **values))


def sensing(world: World, **values: float) -> World:
    """The world with other sensors of the arm."""
    return replace(world, sensing=replace(world.sensing, **values))


def camera(world: World, **values: object) -> World:
    """The world with another camera."""
    return replace(world, camera=replace(world.camera, **values))  # pyright: ignore[reportArgumentType]


def sign(rng: np.random.Generator) -> float:
    """One or minus one."""
    return float(rng.choice([-1.0, 1.0]))


def axis(rng: np.random.Generator) -> float:
    """Any direction (rad)."""
    return float(rng.uniform(0.0, 2 * np.pi))

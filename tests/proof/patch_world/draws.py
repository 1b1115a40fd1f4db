"""The draws: once a session the plate's field, and anew for each run friction, its wander and the contact."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.proof.patch_world.world import History, World

Array = NDArray[np.float64]
SIDE = 6
"""The sole has SIDE × SIDE points."""
_WAVES = 24
_PLATE = 0x5A17


@dataclass(frozen=True, kw_only=True)
class Sole:
    """The points (n, 2) of a sole (block frame, m), their shares of an even load (n), their relative friction (n)."""

    points: Array
    share: Array
    friction: Array


@dataclass(frozen=True, kw_only=True)
class Draw:
    """One run's: its friction relative to the plain one, its field (k, 4), its sole, and the luck of the dust."""

    friction: float
    waves: Array
    sole: Sole
    dust: float


def points_of(half_x: float, half_y: float) -> Array:
    """The points (n, 2): the middles of SIDE × SIDE equal cells of a sole with these half sides (m)."""
    line = (np.arange(SIDE) + 0.5) / SIDE * 2 - 1
    x, y = np.meshgrid(half_x * line, half_y * line)
    return np.ascontiguousarray(np.column_stack([x.ravel(), y.ravel()]))


def field(*, sd: float, length_m: float, rng: np.random.Generator) -> Array:
    """A smooth random field on the plate as (k, 4) waves: wave vector (rad/m), phase, amplitude.

    Its covariance is sd² exp(−d²/(2 length²)), for which the wave vectors are normal with 1/length (Rahimi and Recht).
    """
    if sd == 0.0:
        return np.zeros((0, 4))
    vectors = rng.normal(0.0, 1.0 / length_m, (_WAVES, 2))
    phases = rng.uniform(0.0, 2 * math.pi, _WAVES)
    return np.column_stack([vectors, phases, np.full(_WAVES, sd * math.sqrt(2.0 / _WAVES))])


def plate_waves(world: World) -> Array:
    """The plate's own field (k, 4), the same in every run of a session."""
    patch = world.patch
    rng = np.random.default_rng([patch.field_seed, _PLATE])
    return field(sd=patch.field_sd, length_m=patch.field_length_m, rng=rng)


def run_draw(world: World, *, seed: int, run: int) -> Draw:
    """The draw of a run: it depends on seed and run alone, so that a world without an effect can be given the same."""
    rng = np.random.default_rng([seed, run, 1])
    normal, dust = rng.standard_normal(), rng.random()
    points = points_of(world.contact.half_x, world.contact.half_y)
    pressure, friction = rng.standard_normal((2, len(points)))
    scatter, patch = world.scatter, world.patch
    share = np.exp(scatter.pressure_sd * pressure)
    lopsided = points @ (np.array(patch.lopsided) / (world.contact.half_x, world.contact.half_y))
    sole = Sole(
        points=points,
        share=share / share.sum(),
        friction=np.maximum((1 + lopsided) * np.exp(scatter.sole_sd * friction), 0.05),
    )
    waves = field(sd=scatter.wander_sd, length_m=scatter.wander_length_m, rng=rng)
    return Draw(friction=math.exp(scatter.run_sd * normal), waves=waves, sole=sole, dust=dust)


def dusty(draw: Draw, history: History) -> bool:
    """True if a grain lies under the block in this run."""
    return draw.dust < history.dust_share


def contact_of(draw: Draw, history: History) -> Sole:
    """The sole of a run; a grain takes two thirds of the load onto the point in one corner."""
    if not dusty(draw, history):
        return draw.sole
    share = draw.sole.share / 3
    share[0] += 2 / 3
    return Sole(points=draw.sole.points, share=share, friction=draw.sole.friction)


def friction_of(
    draw: Draw, history: History, *, run: int, time_s: float, azimuth: float, before: float | None
) -> float:
    """The friction of a run relative to the plain one.

    Args:
        draw: of the run.
        history: of the world.
        run: its number, from 1.
        time_s: since the session began.
        azimuth: of its tilting axis (rad).
        before: that of the last run in which the block slid, or None.
    """
    total = draw.friction
    total *= 1 - history.polish * (1 - math.exp(-(run - 1) / history.polish_runs))
    total *= 1 + history.cycle * math.sin(2 * math.pi * time_s / history.cycle_s + history.cycle_phase)
    if before is not None:
        total *= 1 - history.memory * math.cos(azimuth - before)
    return total * (1 - history.dust_drop if dusty(draw, history) else 1)

"""Runs on which simulators are compared, and how far apart they are."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from station.physics.contact import Array
from station.physics.effect import Effect
from station.physics.model import Model, Term
from station.simulators.planar.commands import Commands, ramps, tracks
from station.simulators.planar.simulate import Chances, Motions

MU = 0.36
OPENING_M = 0.045
_STAMP_S = 0.02


@dataclass(frozen=True, eq=False, kw_only=True)
class Apart:
    """The distance of two simulators, (n,) each: onset, the farthest that the paths get apart, and the paths' length.

    `onset_deg` is nan where neither slid, and inf where only one did.
    """

    onset_deg: Array
    path_mm: Array
    length_mm: Array


def typical(effect: Effect, *, size: float = 1.0) -> Model:
    """A model with the effect at its typical values, or a share of them."""
    values = effect.neutral()
    for one in effect.parameters:
        if one.null is not None:
            values[one.name] = one.clipped(one.null + size * one.typical)
    return Model(mu_s=MU, terms=(Term(effect, values),))


def tilts(count: int = 4, *, border_m: float = OPENING_M) -> Commands:
    """Ramps from 17° to 21° (or, for stronger blocks, 29°), a hold, and back: slides of centimetres that stop again."""
    turn = 1.75 * np.arange(count)
    start = np.column_stack([0.012 * np.cos(turn + 2.0), 0.012 * np.sin(turn + 2.0), 0.3 * turn - 1.0])
    return ramps(
        (0.0, 1.2, 1.33, 1.55),
        np.radians([[17.0, 21.2, 21.2, 5.0]]),
        downhill_rad=turn + 0.1,
        border_m=border_m,
        **_differing(count, start=start),
    )


def staircase(count: int = 2) -> Commands:
    """Steps of 1.5° in 0.2 s with smooth beginnings and ends, as an arm makes them, from 15° to 22.5° and down."""
    times = np.arange(0.0, 2.6, 0.005)
    step = np.minimum(np.arange(len(times)) // 80, 4)
    phase = np.clip((np.arange(len(times)) - 80 * step) / 40.0, 0.0, 1.0)
    angle = np.radians(15.0 + 1.5 * (step + phase * phase * (3.0 - 2.0 * phase)))
    angle = np.minimum(angle, np.radians(22.5) - 0.5 * np.maximum(times - 2.1, 0.0))
    turn = 1.75 * np.arange(count)
    down = [np.column_stack([np.sin(angle) * np.cos(t), np.sin(angle) * np.sin(t), -np.cos(angle)]) for t in turn]
    return tracks([times] * count, down, border_m=OPENING_M, **_differing(count))


def _differing(count: int, **given: Any) -> dict[str, Any]:
    """Returns facts of runs that differ, so that every effect has something to act on."""
    number = np.arange(count)
    usual = {
        "run": 10.0 * number,
        "rest_s": 10.0 ** (number % 4),
        "mass_kg": 0.00785 * np.array([1.0, 2.0])[number % 2],
    }
    return usual | {"mount_rad": 0.5 * (number % 3)} | given


def commands_for(effect: Effect, count: int) -> Commands:
    """Runs in which it does something."""
    name = effect.id
    if name == "pivot_offset":
        return staircase(min(count, 2))
    if name == "border_contact":
        return tilts(count, border_m=0.025)
    if name == "adhesion":  # a typical force doubles the weight of the usual block
        return replace(tilts(count), mass_kg=np.full(count, 2.0))
    return tilts(count)


def chances_for(commands: Commands) -> Chances:
    """Shaking that lets blocks slip earlier or hold longer by various amounts, and the usual friction."""
    return Chances(friction=np.ones(len(commands)), shake=np.linspace(-1.0, 1.0, len(commands)))


def stamps_of(commands: Commands) -> Array:
    """Moments all through the runs (m,)."""
    return np.arange(0.0, float(commands.end_s.max()) + 1e-9, _STAMP_S)


def apart(first: Motions, second: Motions) -> Apart:
    """Compares what two simulators made of the same runs."""
    slid = np.isfinite(first.onset_rad), np.isfinite(second.onset_rad)
    onset = np.degrees(np.abs(second.onset_rad - first.onset_rad))
    between, way = first.path - second.path, first.path - first.path[:, :1]
    return Apart(
        onset_deg=np.where(slid[0] == slid[1], onset, np.inf),
        path_mm=1e3 * np.linalg.norm(between[..., :2], axis=2).max(axis=1),
        length_mm=1e3 * np.linalg.norm(way[..., :2], axis=2).max(axis=1),
    )

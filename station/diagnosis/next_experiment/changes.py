"""The changes that a plan can make: dwell, direction, rate of tilt, load, place and heading, each at random.

A change draws its numbers anew for every run, so they are independent of the order and of everything else: what
coincided in the recording no longer does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from station.diagnosis.next_experiment.redone import Draw
from station.physics.contact import Array

Vary = Callable[[np.random.Generator, int, Draw], None]
"""Changes a protocol's numbers, (runs,) each by name, in place."""

Tables = Mapping[str, Mapping[str, object]]

BY_HAND_S = 30.0
"""The cost in seconds of a run before which a person has to do something: somebody has to be there all the time.
Another value moves the border between a short plan by hand and a long one without (`station plan --separate A,B`)."""
OTHERWISE_S = 8.0
"""The time of a run beside its dwell and its tilt at the full rate: reference, the steps' waits, return and rest
(`station run --lockstep`, 50 runs)."""

RATES_DEG_S = (2.0, 12.0)
MASS, MASSES = "mass", (0.5, 1.0, 2.0, 5.0)
"""The factor that a person changes, and its values over the recorded median."""
MOUNTS_RAD = (0.0, math.pi / 4, math.pi / 2, math.pi)
SPREAD_M = 0.02


@dataclass(frozen=True, eq=False)
class Change:
    """One change of a session: its words, its tables of the plan file, and what a person must do."""

    name: str
    factor: str
    vary: Vary
    tables: Tables = field(default_factory=dict[str, Mapping[str, object]])
    by_hand: str = ""


Changes = tuple[Change, ...]
"""A design: changes that are made together; an empty one is the same session again."""


def _between(low: float, high: float) -> Vary:
    def vary(rng: np.random.Generator, runs: int, draw: Draw) -> None:
        draw["dwell_s"] = np.exp(rng.uniform(math.log(low), math.log(high), runs))

    return vary


def _dwell(low: float, high: float) -> Change:
    name = f"dwell drawn at random from {low:g} to {high:g} s"
    return Change(name, "dwell", _between(low, high), {"dwell": {"min_s": low, "max_s": high}})


def _any_way(rng: np.random.Generator, runs: int, draw: Draw) -> None:
    draw["down"] = rng.uniform(-math.pi, math.pi, runs)


def _rates(rng: np.random.Generator, runs: int, draw: Draw) -> None:
    draw["rate"] = np.radians(_dealt(rng, runs, RATES_DEG_S))


def _masses(rng: np.random.Generator, runs: int, draw: Draw) -> None:
    draw["mass_kg"] = float(np.median(draw["mass_kg"])) * _dealt(rng, runs, MASSES)


def _mounts(rng: np.random.Generator, runs: int, draw: Draw) -> None:
    draw["mount"] = _dealt(rng, runs, MOUNTS_RAD)


def _headings(rng: np.random.Generator, runs: int, draw: Draw) -> None:
    draw["yaw"] = rng.uniform(-math.pi, math.pi, runs)


def _places(rng: np.random.Generator, runs: int, draw: Draw) -> None:
    draw["x"], draw["y"] = rng.uniform(-SPREAD_M, SPREAD_M, (2, runs))


def _dealt(rng: np.random.Generator, runs: int, values: tuple[float, ...]) -> Array:
    """Returns the values (runs,) in random order, each as often as the others."""
    return rng.permutation(np.resize(np.array(values), runs))


FREE = Change("directions drawn at random", "direction", _any_way, {"direction": {"mode": "free"}})
SINGLE: Changes = (
    _dwell(0.5, 30.0),
    _dwell(0.5, 100.0),
    FREE,
    Change(
        f"tilt rates drawn at random from {RATES_DEG_S[0]:g} and {RATES_DEG_S[1]:g} °/s",
        "rate",
        _rates,
        {"tilt": {"rates_deg_s": list(RATES_DEG_S)}},
    ),
    Change(
        "loads of ×0.5, 1, 2 and 5 in random order",
        MASS,
        _masses,
        by_hand="change the block's mass (×0.5, 1, 2, 5) in random order, and name it in the rig file",
    ),
    Change(
        "plate turned in its mount",
        "mount",
        _mounts,
        by_hand="turn the plate by 45°, 90° and 180° in its mount in random order, and name the angle in the rig file",
    ),
    Change("block turned", "heading", _headings, by_hand="turn the block by a random angle every few runs"),
    Change("designed starts", "place", _places, by_hand="put the block back to a random place every few runs"),
)


def designs() -> Iterator[Changes]:
    """Yields the same session again, and every change alone."""
    yield ()
    yield from ((one,) for one in SINGLE)


def together(first: Change) -> Iterator[Changes]:
    """Yields a change with each other that concerns something else."""
    yield from ((first, other) for other in SINGLE if other.factor != first.factor)


def run_s(draw: Draw, *, tilt_rad: float, changes: Changes) -> float:
    """Returns the mean duration of a run, s, a person's time included."""
    hands = sum(bool(change.by_hand) for change in changes) or int(np.ptp(draw["mass_kg"]) > 0.0)
    return float(np.mean(draw["dwell_s"] + tilt_rad / draw["rate"])) + OTHERWISE_S + BY_HAND_S * hands

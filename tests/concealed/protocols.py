"""Draws how a session is done: protocol, pair, scatter and noise, within what a tier wants."""

from __future__ import annotations

import math
from collections import abc
from collections.abc import Collection
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import replace
from typing import Any

from numpy.random import Generator

from tests.concealed.design import PAIRS, Design, Nuisance, Setting
from tests.concealed.world import GRAVITY, NULL, World

FEATURES = ("free", "yaw", "replace", "masses", "mounts", "dwell", "rates", "sensor", "border")
"""The factors that a protocol may vary: azimuth, the block's yaw, its place, its mass, the plate's mount, dwell, tilt
rate; whether another angle sensor looks on; and whether slides reach the foam."""

_MOST_RUNS = ContextVar("_MOST_RUNS", default=500)

_EXTRAS = ("free", "yaw", "replace", "masses", "mounts", "dwell", "rates", "sensor")


def draw_design(
    rng: Generator, *, pair: str, scatter: float, runs: int, needs: Collection[str], without: Collection[str]
) -> Design:
    """A protocol with the features that are needed, and perhaps more of them, but not those of `without`."""
    features = set(needs)
    features |= {name for name in _EXTRAS if rng.random() < 0.15} - set(without)
    kind = rng.choice(["paper", "short", "one"], p=[0.3, 0.6, 0.1])
    changes: dict[str, Any] = {}
    mean_deg = math.degrees(math.atan(PAIRS[pair][2]))
    if kind == "paper":
        changes |= {"wide_deg": 67.5, "wide_steps": 50, "steps": 50, "adapt_after": 25}
    else:
        wide = min(mean_deg * (1.25 + 4.0 * scatter) + 4.0, 67.5)
        changes |= {"wide_deg": wide, "wide_steps": max(10, round(wide / 1.8)), "steps": 30, "adapt_after": 8}
    if kind == "one" and not (features | set(without)) & {"free", "yaw", "mounts", "border"}:
        changes |= {"directions": (int(rng.integers(4)),), "handled_every": 1}
    changes["rates_deg_s"] = (float(rng.choice([5.0, 8.0, 10.0])),)
    return Design(runs=runs, pair=pair, **(changes | _of_features(features, rng)))


def _of_features(features: Collection[str], rng: Generator) -> dict[str, Any]:
    changes: dict[str, Any] = {}
    if "free" in features:
        changes["free"] = True
    if "yaw" in features:
        changes |= {"handled_every": 4, "yaw_varies": True}
    if "replace" in features:
        changes["handled_every"] = 3
    if "masses" in features:
        changes["masses"] = (0.5, 1.0, 2.0)
    if "mounts" in features:
        changes["mounts_deg"] = (0.0, 90.0, 180.0, 270.0) if rng.random() < 0.5 else (0.0, 45.0, 180.0, 225.0)
    if "dwell" in features:
        changes["dwell_s"] = (0.3, 6.0)
    if "rates" in features:
        changes["rates_deg_s"] = (3.0, 6.0, 14.0)
    if "sensor" in features:
        changes |= {"second_sensor": True, "sensor_noise_deg": float(rng.choice([0.05, 0.1, 0.3]))}
    if "border" in features:
        changes |= {"min_slide_px": 20.0, "handled_every": 0}
    return changes


def draw_nuisance(rng: Generator, *, runs: int, harsh: bool) -> Nuisance:
    """Scatter 5 to 20 %, noise 0.1 to 1 px; with `harsh`, outliers, dropouts and drifting noise as well."""
    scatter = float(rng.uniform(0.05, 0.2))
    noise = math.exp(float(rng.uniform(math.log(0.1), math.log(1.0))))
    plain = Nuisance(scatter=scatter, noise_px=noise)
    if not harsh:
        return plain
    return replace(
        plain,
        tail=float(rng.uniform(3.0, 8.0)),
        noise_drift=float(rng.uniform(0.0, 1.0 / noise - 1.0)) if noise < 0.5 else 0.0,
        knocks=float(rng.uniform(0.0, max(0.03, 1.5 / runs))),
        dropouts=float(rng.uniform(0.0, 0.04)),
    )


@contextmanager
def at_most(runs: int) -> abc.Generator[None]:
    """Sessions that are drawn within have at most so many runs; the limits of effects are those of the session."""
    before = _MOST_RUNS.set(runs)
    try:
        yield
    finally:
        _MOST_RUNS.reset(before)


def draw_runs(rng: Generator) -> int:
    """50 to 500 runs (or to those of `at_most`), equally often in every part of the logarithm."""
    return round(math.exp(float(rng.uniform(math.log(50.0), math.log(_MOST_RUNS.get())))))


def draw_setting(
    rng: Generator,
    *,
    needs: Collection[str] = (),
    without: Collection[str] = (),
    harsh: bool = False,
    runs: int | None = None,
    calm: bool = False,
) -> Setting:
    """A session's setting in a world without any effect; `calm` sessions scatter by a tenth at most."""
    pair = str(rng.choice(list(PAIRS)))
    runs = draw_runs(rng) if runs is None else runs
    nuisance = draw_nuisance(rng, runs=runs, harsh=harsh)
    if calm:
        nuisance = replace(nuisance, scatter=min(nuisance.scatter, float(rng.uniform(0.05, 0.1))))
    design = draw_design(rng, pair=pair, scatter=nuisance.scatter, runs=runs, needs=needs, without=without)
    return Setting(design=design, nuisance=nuisance, world=_world(pair, rng, border="border" in needs))


def _world(pair: str, rng: Generator, *, border: bool) -> World:
    mu, cube_kg = PAIRS[pair][2:]
    return NULL._replace(
        mu=mu * math.exp(float(rng.normal(0.0, 0.05))),
        load_reference_n=cube_kg * GRAVITY,
        wall_radius=0.024 if border else NULL.wall_radius,
    )

"""The beginning of slides is read from what all of a session's slides have in common, whatever falls or drags."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from shared.geometry import Array
from station.diagnosis.observations.breakaway import LOGARITHM, Breakaways, Law
from station.diagnosis.observations.breakaway_law import GAIN, session_law
from station.diagnosis.observations.early import FARTHEST_M, GRID_S, Early
from station.diagnosis.observations.first_look import Look, first_look
from station.physics.contact import GRAVITY_M_S2

RUNS, FRAME_S, NOISE_M = 16, 1 / 90, 3e-5
RATE_RAD_S, MU = math.radians(3.0), 0.35
EXACT_S = 2e-4

Friction = Callable[[float], float]
"""The ratio of friction to the static one, as a function of speed (m/s)."""

LAWS: dict[str, tuple[Friction, Law]] = {
    "plain": (lambda _: 1.0, Law()),
    "sudden fall and drag": (lambda _: 0.97, Law(drop=0.03, drag_per_s=3.0)),
    "gentle fall and drag": (
        lambda speed: 1.0 - 0.05 * (1.0 - math.exp(-speed / 0.03)),
        Law(fall=0.05, fall_speed_m_s=0.03, drag_per_s=3.0),
    ),
    "fall that a drag makes up for": (
        lambda speed: 1.0 - 0.06 * (1.0 - math.exp(-speed / 0.03)),
        Law(fall=0.06, fall_speed_m_s=0.03, drag_per_s=2.0),
    ),
    "rise": (
        lambda speed: 1.0 + 0.02 * math.log1p(speed / 0.005),
        Law(fall=-0.02, fall_speed_m_s=0.005, shape=LOGARITHM),
    ),
}


def _path(friction: Friction, drag_per_s: float, tilt_rad: float) -> tuple[Array, Array]:
    """Times from the slip, s, and the way of a block that is let go at a tilt, by small steps (the exact slider)."""
    times, ways, speed, way = [0.0], [0.0], 0.0, 0.0
    mu = math.tan(tilt_rad)
    while way < 1.2 * FARTHEST_M:
        tilt = tilt_rad + RATE_RAD_S * (times[-1] + 0.5 * EXACT_S)
        held = GRAVITY_M_S2 * math.cos(tilt) * mu * friction(speed)
        faster = max(speed + EXACT_S * (GRAVITY_M_S2 * math.sin(tilt) - held - drag_per_s * speed), 0.0)
        way += 0.5 * EXACT_S * (speed + faster)
        speed = faster
        times.append(times[-1] + EXACT_S)
        ways.append(way)
    return np.array(times), np.array(ways)


def one_run(friction: Friction, drag_per_s: float, rng: np.random.Generator) -> tuple[Early, float]:
    """A run as it is recorded, and when it slipped, s from what the rig took for it."""
    tilt_rad = math.atan(MU * math.exp(rng.normal(0.0, 0.1)))
    slip_s = float(rng.uniform(-0.03, 0.03))
    since, way = _path(friction, drag_per_s, tilt_rad)
    time_s = np.arange(-0.55 + rng.uniform(0.0, FRAME_S), slip_s + since[-1], FRAME_S)
    path_m = np.interp(time_s - slip_s, since, way) + rng.normal(0.0, NOISE_M, len(time_s))
    grid_s = np.arange(time_s[0] - GRID_S, time_s[-1] + 2 * GRID_S, GRID_S)
    tilt = tilt_rad + RATE_RAD_S * (grid_s - slip_s)
    pull, press = GRAVITY_M_S2 * np.sin(tilt), GRAVITY_M_S2 * np.cos(tilt)
    run = Early(
        time_s=time_s, path_m=path_m, sigma_m=NOISE_M, grid_s=grid_s, pull=pull, press=press, tilt_rad=tilt,
        plate_rad=tilt,
    )  # fmt: skip
    return run, slip_s


def looked_at(run: Early) -> tuple[Early, Look]:
    look = first_look(run)
    assert look is not None
    return run, look


def _worth(paths: Breakaways, law: Law) -> float:
    """ln of the likelihood, less what the numbers have to bring; half a unit of it tells no laws apart."""
    return paths.around(law, 41).log_likelihood(law) - GAIN * ((law.drop != 0.0) + 2 * (law.fall != 0.0))


@pytest.mark.parametrize("name", LAWS)
def test_slips_are_read_from_what_they_have_in_common(name: str) -> None:
    """All alike to a few milliseconds (a hundredth of a degree), and each beside the others within what it says."""
    friction, planted = LAWS[name]
    rng = np.random.default_rng(5)
    runs, slip_s = zip(*(one_run(friction, planted.drag_per_s, rng) for _ in range(RUNS)), strict=True)
    seen = [looked_at(run) for run in runs]
    paths = Breakaways.of(seen)
    law = session_law(paths, drag_per_s=float(np.median([look.drag_per_s for _, look in seen])))
    assert _worth(paths, law) > _worth(paths, replace(planted, drop_spread=law.drop_spread, creep_m=law.creep_m)) - 0.5
    paths = paths.nearer(law, 41).nearer(law, 41)
    chance = paths.chances(law)
    mean = (chance * paths.tried_s).sum(axis=1)
    sigma = np.sqrt((chance * (paths.tried_s - mean[:, None]) ** 2).sum(axis=1))
    error = mean - np.array(slip_s)
    assert abs(error.mean()) < 5e-3, law
    assert np.std(error / sigma) < 1.6, (law, error, sigma)
    if name == "plain":
        assert (law.drop, law.fall) == (0.0, 0.0)
        assert abs(law.drag_per_s) < 0.1

"""The planar simulator's 3-second tilts a second on one core are counted; run with `pytest -m benchmark -s`."""

from __future__ import annotations

import time

import numpy as np
import pytest

from station.physics.catalogue import catalogue
from station.physics.model import Model, Term
from station.simulators.planar.commands import Commands, ramps
from station.simulators.planar.simulate import simulate

GATE = 10_000
COUNT = 8192
REPEATS = 3
MODELS = {"plain": Model(mu_s=0.42)} | {
    name: Model(mu_s=0.42, terms=(Term(effect, {own.name: own.typical for own in effect.parameters}),))
    for name, effect in catalogue().items()
}


def tilts(count: int) -> Commands:
    """Up in 2.5 s at 4.6 °/s, down in 0.5 s; slopes in all directions; heavy blocks, so that none is held."""
    return ramps((0.0, 2.5, 3.0), (0.25, 0.45, 0.1), downhill_rad=np.linspace(0.0, 6.2, count), mass_kg=1.0)


def rate(model: Model, *, stamps: int) -> tuple[float, float]:
    """Tilts a second of processor time, the best of some repeats, and the mean way that the blocks slid."""
    commands, times = tilts(COUNT), np.linspace(0.0, 3.0, stamps)
    best, way = 0.0, 0.0
    for _ in range(REPEATS):
        begin = time.thread_time()
        motions = simulate(commands, model, time_s=times)
        best = max(best, COUNT / (time.thread_time() - begin))
        way = float(np.linalg.norm(motions.pose[:, :2], axis=1).mean())
    return best, way


@pytest.mark.benchmark
@pytest.mark.parametrize("name", MODELS)
def test_tilts_per_second(name: str) -> None:
    best, way = rate(MODELS[name], stamps=0)
    verdict = "" if best >= GATE else f"   below {GATE}"
    print(f"\n{name:20s} {best:8.0f} tilts of 3 s a second of one core, slid {way * 1e3:6.1f} mm{verdict}", end="")
    assert way > 0


@pytest.mark.benchmark
@pytest.mark.parametrize("stamps", [0, 90, 300])
def test_with_the_path_wanted(stamps: int) -> None:
    best, _ = rate(MODELS["plain"], stamps=stamps)
    print(f"\nplain, {stamps:3d} stamps a tilt: {best:8.0f} tilts of 3 s a second of one core", end="")
    assert best > 0

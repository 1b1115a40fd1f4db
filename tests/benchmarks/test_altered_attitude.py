"""Concealed sessions are diagnosed whose arm reports its attitude with noise and its rates filtered.

    ALTERED_SESSIONS=4 ALTERED_SEED=20261320 pytest -m benchmark -s tests/benchmarks/test_altered_attitude.py

makes so many sessions of 120 runs with nothing concealed, and as many with a friction that grows with the speed, from
that seed on; each is diagnosed as six arms would report it. It prints every answer and the counts.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from shared.rig import load_rig
from station.app.setting import setting_of
from station.diagnosis.diagnose import examined
from station.physics.catalogue import catalogue_of_table
from station.signals.session import Signals
from tests.concealed.world import NULL
from tests.recovery.altered_attitude import Arm, concealed, reported

pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(4 * 3600)]

SESSIONS, SEED = int(os.environ.get("ALTERED_SESSIONS", "4")), int(os.environ.get("ALTERED_SEED", "20261320"))
RUNS = 120
ARMS = [Arm(noise_rad=noise, filtered_s=length) for length in (0.0, 0.08) for noise in (0.0, 4e-4, 1.6e-3)]
GROWING = NULL._replace(rate_gain=0.03)


def claimed(signals: Signals, rig_path: Path, *, seed: int) -> list[set[str]]:
    """Returns the ids of the effects that are claimed of a session, for each of the arms."""
    rig, said = load_rig(rig_path), list[set[str]]()
    for arm in ARMS:
        known = catalogue_of_table(rig.physics)
        found = examined(reported(signals, arm, seed=seed), known, setting=setting_of(rig)).diagnosis
        said.append({effect.id for effect in found.effects if effect.id in found.names})
        print(f"{seed} {arm}: {found.verdict} {said[-1]}, global p {found.global_p:.4f}", flush=True)
    return said


def test_nulls_stay_silent(tmp_path: Path) -> None:
    said = [one for seed in _seeds() for one in claimed(*concealed(tmp_path, seed=seed, runs=RUNS), seed=seed)]
    silent = sum(not one for one in said)
    print(f"silent: {silent} of {len(said)}")
    assert silent == len(said)


def test_a_planted_effect_is_found(tmp_path: Path) -> None:
    made = ((seed, concealed(tmp_path, seed=seed, runs=RUNS, world=GROWING)) for seed in _seeds())
    said = [one for seed, session in made for one in claimed(*session, seed=seed)]
    found = sum("rate_strengthening" in one for one in said)
    print(f"rate_strengthening: {found} of {len(said)}")
    assert found >= 0.9 * len(said)


def _seeds() -> range:
    return range(SEED, SEED + SESSIONS)

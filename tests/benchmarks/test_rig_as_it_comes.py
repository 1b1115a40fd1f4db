"""The diagnosis of the simulated rig is judged: with the sag that its camera has, and with none.

    RIG_SESSIONS=20 RIG_SEED=20261301 pytest -m benchmark -s tests/benchmarks/test_rig_as_it_comes.py

runs 20 sessions of 120 samples of each kind, from that seed on, and prints every session and the counts with Wilson's
95 % intervals.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.proof.intervals import wilson
from tests.recovery.rig_as_it_comes import rig_with, said_of

pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(4 * 3600)]

SESSIONS, SEED = int(os.environ.get("RIG_SESSIONS", "20")), int(os.environ.get("RIG_SEED", "101"))
GATE = 19 / 20


@pytest.mark.parametrize(("sag_px", "right"), [(None, ["camera_sag"]), (0.0, [])], ids=["as it comes", "no sag"])
def test_what_is_said_of_the_simulated_rig(sag_px: float | None, right: list[str], tmp_path: Path) -> None:
    good = 0
    for seed in range(SEED, SEED + SESSIONS):
        said = said_of(rig_with(sag_px=sag_px), seed=seed, folder=tmp_path)
        good += list(said.claimed) == right
        print(f"{said.seed}: {said.verdict}, {said.claimed}, global p {said.global_p:.4f}", flush=True)
    low, high = wilson(good, SESSIONS)
    print(f"{'sag' if right else 'silence'}, alone: {good} of {SESSIONS} ({100 * low:.0f} to {100 * high:.0f} %)")
    assert good >= GATE * SESSIONS

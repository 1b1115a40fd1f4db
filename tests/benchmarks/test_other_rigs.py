"""One session without any effect, and one with a strong one, as rigs of other makes would have recorded them.

    OTHER_SEED=20261129 pytest -m benchmark -s tests/benchmarks/test_other_rigs.py

prints what is said of each session on each rig. Of the first nothing may be claimed, and the second's effect must stand
first in what is.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from station.app.diagnosing import diagnose_session
from station.app.simulating import rig_of
from station.recording.arrays import load_signals
from station.recording.opening import open_recording
from tests.benchmarks.other_rigs import RIGS
from tests.proof.patch_world.making import RECORDING, Order, make, name_of, seal

pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(2 * 3600)]

SEED = int(os.environ.get("OTHER_SEED", "20261129"))
SESSIONS = {"nothing": ("null_nuisance", ()), "stribeck": ("single", ("velocity_weakening",))}


@pytest.mark.parametrize("hidden", SESSIONS)
def test_what_is_said_of_other_rigs(hidden: str, tmp_path: Path) -> None:
    tier, only = SESSIONS[hidden]
    order = Order(out=tmp_path, tier=tier, cases=1, seed=SEED, runs=60, only=only)
    seal(order, jobs=1)
    make(order, jobs=1, tell=print)
    reader = open_recording(tmp_path / name_of(1) / RECORDING)
    signals, rig, wrong = load_signals(reader), rig_of(reader), list[str]()
    for said, made in RIGS.items():
        found = diagnose_session(made(signals), name=said, rig=rig).diagnosis
        claims = [("+".join(claim.class_ids), round(claim.probability, 2)) for claim in found.effects]
        right = hidden in (claims[0][0] if claims else "nothing")
        print(f"{hidden}, {said}: {claims}, p {found.global_p:.3g}{'' if right else ', WRONG'}", flush=True)
        wrong += [] if right else [said]
    assert not wrong

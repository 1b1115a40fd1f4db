"""Sessions without any effect, and with a strong one, as other people would plan them, with other blocks and plates.

    OTHER_SEED=20261131 pytest -m benchmark -s tests/benchmarks/test_other_sessions.py

prints what is said of each. Of the first nothing may be claimed, and the second's effect must stand first in what is.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from station.app.diagnosing import diagnose_session
from station.app.simulating import rig_of
from station.recording.arrays import load_signals
from station.recording.opening import open_recording
from tests.benchmarks.other_sessions import DESIGNS, Design
from tests.proof.patch_world import rig as rigs
from tests.proof.patch_world.cases import make_case
from tests.proof.patch_world.making import RECORDING, record

pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(2 * 3600)]

SEED = int(os.environ.get("OTHER_SEED", "20261131"))
SESSIONS = {"nothing": ("null_nuisance", ()), "stribeck": ("single", ("velocity_weakening",))}


def recorded(path: Path, design: Design, hidden: str) -> Path:
    """Records one session of a design."""
    tier, only = SESSIONS[hidden]
    case = make_case("001", tier, only, seed=SEED, runs=design.runs)
    plan, text = design.planned(rigs.plan(runs=design.runs, seed=SEED)), rigs.rig_toml(design.built(case.plain).contact)
    _, fault = record(path / RECORDING, design.built(case.world), plan, rig_toml=text, seed=SEED)
    assert not fault
    return path / RECORDING


@pytest.mark.parametrize("hidden", SESSIONS)
def test_what_is_said_of_other_sessions(hidden: str, tmp_path: Path) -> None:
    wrong = list[str]()
    for number, (said, design) in enumerate(DESIGNS.items()):
        folder = tmp_path / str(number)
        folder.mkdir()
        reader = open_recording(recorded(folder, design, hidden))
        found = diagnose_session(load_signals(reader), name=said, rig=rig_of(reader)).diagnosis
        claims = [
            ("+".join(one.class_ids), round(one.probability, 2)) for one in found.effects if one.id in found.names
        ]
        right = hidden in (claims[0][0] if claims else "nothing")
        print(f"{hidden}, {said}: {claims}, p {found.global_p:.3g}{'' if right else ', WRONG'}", flush=True)
        wrong += [] if right else [said]
    assert not wrong

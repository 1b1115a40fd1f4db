"""A null of the other generator: soles lie anew in each run, friction wanders, and the arm is noisy and rings."""

from __future__ import annotations

from pathlib import Path

import pytest

from station.app.diagnosing import diagnose_file
from tests.proof.patch_world.__main__ import main

pytestmark = pytest.mark.timeout(900)

LEAST_P = 1e-3
"""A null of a fixed seed: a p below this would come once in a thousand seeds. It was 1e-6 in 6 of 6 (60 runs)."""


def test_uneven_soles_and_a_poor_arm_are_no_finding(tmp_path: Path) -> None:
    order = ["--tier", "null_nuisance", "--cases", "1", "--seed", "20261445", "--runs", "24"]
    assert main(["--out", str(tmp_path), *order]) == 0
    case = tmp_path / "001"
    diagnosis = diagnose_file(case / "session.mcap", rig=case / "rig.toml").diagnosis
    assert diagnosis.global_p > LEAST_P
    assert not diagnosis.effects

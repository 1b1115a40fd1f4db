"""Two real tables of friction are diagnosed, and copies with their labels dealt anew, its nulls.

    REPOSE_REAL_DATA=/work/shared/data pytest -m benchmark -s tests/benchmarks/test_real_tables.py

prints what is claimed of each; TABLES_COPIES says how many copies there are (20). `real_tables` says how a copy is
made.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from station.app.diagnosing import diagnose_file
from station.diagnosis.report.sentences import sentence
from station.diagnosis.result import Diagnosis, EffectFound
from tests.benchmarks.real_tables import Silicone, SpeedStep
from tests.proof.intervals import wilson

DATA = Path(os.environ.get("REPOSE_REAL_DATA", "/none"))
SILICONE, STEP = DATA / "silicone-load" / "friction.csv", DATA / "velocity-steps" / "sepiolite.csv"
COPIES = int(os.environ.get("TABLES_COPIES", "20"))
CHANCE = 0.05
PER_E_FOLD, WITHIN = 0.020, 0.004
"""The step's change of the coefficient per e-fold of speed at steady state, by hand from its levels (its README)."""

needs_data = pytest.mark.skipif(not SILICONE.is_file(), reason="REPOSE_REAL_DATA does not name the folder of data")
pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(3600), needs_data]


def claimed(found: Diagnosis) -> list[EffectFound]:
    return [one for one in found.effects if one.verdict in {"supported", "indistinguishable"}]


def said(name: str, found: Diagnosis) -> str:
    claims = ", ".join(f"{'/'.join(one.class_ids)} ({one.probability:.2f})" for one in claimed(found)) or "nothing"
    return f"{name:22s} {found.verdict:18s} p = {found.global_p:<8.2g} {claims}"


@pytest.mark.parametrize("ordered", [True, False])
@pytest.mark.parametrize("kind", ["cycles", "means"])
def test_silicone_has_a_law_of_the_load(kind: str, ordered: bool, tmp_path: Path) -> None:
    """The load was raised from one sequence to the next: order and load are one, unless the order does no harm."""
    write = getattr(Silicone.of(SILICONE), kind)
    found = diagnose_file(write(tmp_path / "table.csv", ordered=ordered)).diagnosis
    print("\n" + said(kind if ordered else f"{kind}, without order", found))
    (effect,) = claimed(found)
    assert "load_dependence" in effect.class_ids
    if not ordered:
        fall = effect.parameters["exponent"]
        print(f"{'':22s} exponent {fall}, 90 % in {fall.interval90}, from {effect.parameters['from_log10_n']}")
        assert effect.class_ids == ("load_dependence",)
        assert 0.3 < fall.value < 0.5


def test_the_step_of_the_speed_has_its_slope_and_a_transient(tmp_path: Path) -> None:
    found = diagnose_file(SpeedStep.of(STEP).record(tmp_path / "table.csv")).diagnosis
    print("\n" + said("speed step", found))
    (effect,) = claimed(found)
    # Two speeds tell a law of the speed, and not its form: "a change with the speed" may stand beside the names.
    assert effect.id == "rate_strengthening"
    assert set(effect.class_ids) - {"viscous"} in ({"rate_strengthening"}, {"rate_strengthening", "other"})
    if "other" in effect.class_ids:
        assert "rate_strengthening or a change with the speed," in sentence(found)
    (slope,) = effect.determined
    print(f"{'':22s} {slope.expression}: {slope.known}; {', '.join(one.summary for one in found.located)}")
    assert "per e-fold of speed" in slope.expression
    assert abs(slope.value - PER_E_FOLD) < WITHIN
    assert 0.0 < slope.sd < WITHIN
    assert "settled" in {place.covariate for place in found.located}, "the law has no transient"


@pytest.mark.parametrize("kind", ["cycles", "means", "speed step"])
def test_labels_dealt_anew_are_met_with_silence(kind: str, tmp_path: Path) -> None:
    silent = 0
    for number in range(COPIES):
        rng, path = np.random.default_rng([20261123, number]), tmp_path / f"{number}.csv"
        if kind == "speed step":
            SpeedStep.of(STEP).dealt(path, rng)
        else:
            getattr(Silicone.of(SILICONE).dealt(rng), kind)(path)
        found = diagnose_file(path).diagnosis
        silent += not claimed(found)
        print(said(f"{kind}, copy {number}", found), flush=True)
    low, high = wilson(silent, COPIES)
    print(f"silent of {kind}: {silent} of {COPIES}, {silent / COPIES:.0%} ({low:.0%} … {high:.0%} at 95 %)")
    assert high >= 1.0 - CHANCE

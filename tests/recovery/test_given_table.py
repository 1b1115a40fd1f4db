"""A table against a simulated one: the answer is about the difference of the two."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from shared.errors import UserError
from station.app.diagnosing import diagnose_file
from station.diagnosis.report.sentences import sentence
from station.diagnosis.result import Diagnosis
from tests.benchmarks.real_tables import written

RUNS = 80
LOADS_N = np.geomspace(0.05, 1.0, RUNS)


def table(path: Path, *, level: float, exponent: float, scatter: float = 0.0, moving: bool = True) -> Path:
    order = np.random.default_rng(1).permutation(RUNS)
    load = LOADS_N[order]
    friction = level * (load / 0.1) ** -exponent * np.exp(np.random.default_rng(2).normal(0.0, scatter, RUNS))
    columns = {
        "normal_load_n": load,
        "sliding_speed_m_s": np.full(RUNS, 0.01 * moving),
        "friction_coefficient": friction,
    }
    return written(columns, path)


@cache
def answer(folder: Path, level: float, exponent: float) -> Diagnosis:
    real = table(folder / "real.csv", level=0.8, exponent=0.3, scatter=0.03)
    given = table(folder / f"{level}-{exponent}.csv", level=level, exponent=exponent)
    return diagnose_file(real, simulate=str(given)).diagnosis


def sides(found: Diagnosis) -> dict[str, str]:
    return {one.id: one.side for one in found.effects if one.verdict != "not supported"}


def test_a_law_that_the_simulation_lacks_is_left_out(tmp_path: Path) -> None:
    found = answer(tmp_path, 0.8, 0.0)
    assert sides(found) == {"load_dependence": "recording"}
    assert found.given


def test_a_simulation_that_has_it_leaves_nothing_out(tmp_path: Path) -> None:
    assert sentence(answer(tmp_path, 0.8, 0.3)) == "Nothing is left out of the simulation."


def test_half_of_it_differs(tmp_path: Path) -> None:
    found = answer(tmp_path, 0.8, 0.15)
    assert sides(found) == {"load_dependence": "both"}
    (exponent,) = [one for one in found.differs if one.name == "load_dependence.exponent"]
    assert exponent.recording.value == pytest.approx(0.3, abs=0.05)
    assert exponent.simulation.value == pytest.approx(0.15, abs=0.03)


def test_another_level_is_said(tmp_path: Path) -> None:
    found = answer(tmp_path, 0.6, 0.3)
    assert sides(found) == {}
    assert [one.name for one in found.differs] == ["mu_s"]


def test_what_cannot_be_compared_is_one_sentence(tmp_path: Path) -> None:
    real = table(tmp_path / "real.csv", level=0.8, exponent=0.3, scatter=0.03)
    with pytest.raises(UserError, match=r"Expected a simulated table \(.csv, .parquet\) together with a table"):
        diagnose_file(real, simulate="sim.mcap")
    resting = table(tmp_path / "resting.csv", level=0.8, exponent=0.3, moving=False)
    with pytest.raises(UserError, match="with friction while sliding, as the measured one has"):
        diagnose_file(real, simulate=str(resting))

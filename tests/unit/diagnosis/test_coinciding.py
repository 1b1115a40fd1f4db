"""Covariates that run together, and what laws of them are excused."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.table import table_evidence
from station.diagnosis.search.coinciding import Coinciding
from station.diagnosis.search.smooth import smooth_terms
from station.physics.catalogue import catalogue
from tests.unit.diagnosis.test_measured_tables import RUNS, under_loads

KNOWN = catalogue()


def among(order: NDArray[np.int64]) -> Coinciding:
    seen = table_evidence(under_loads(order, run=np.arange(RUNS)), Setting())
    return Coinciding.among(seen, [*KNOWN.values(), *smooth_terms(seen)])


@pytest.mark.parametrize("order", [np.arange(RUNS), np.arange(RUNS)[::-1]])
def test_a_load_that_rises_or_falls_with_the_runs_coincides_with_them(order: NDArray[np.int64]) -> None:
    found = among(order)
    assert found.together == {"run", "mass_kg"}
    assert found.of["wear"] == "run"
    assert found.of["load_dependence"] == found.of["adhesion"] == "mass_kg"
    assert found.repeats(KNOWN["wear"], ["load_dependence"])
    assert not found.repeats(KNOWN["kinetic_drop"], ["load_dependence"])


def test_loads_in_random_order_do_not() -> None:
    found = among(np.random.default_rng(3).permutation(RUNS))
    assert not found.together
    assert not found.repeats(KNOWN["wear"], ["load_dependence"])


def test_a_smooth_term_depends_on_its_covariate() -> None:
    found = among(np.arange(RUNS))
    smooth = {name: on for name, on in found.of.items() if name.startswith("other:")}
    assert {on for name, on in smooth.items() if "load" in name} == {"mass_kg"}
    assert {on for name, on in smooth.items() if "run" in name} == {"run"}

import math

import numpy as np
import pytest

from station.prove.rivals import NOT_HERE, reasons, rivals
from station.prove.terms import Terms
from station.prove.versus import versus
from tests.unit.prove.made_up import claim, concealed, place, said, scored, truth


def planted(rng: np.random.Generator, *, slope: float, rows: int = 240) -> Terms:
    """A table of onsets whose residuals follow its second column by `slope`, with a scatter of 5 %."""
    columns = rng.normal(size=(rows, 4))
    return Terms(
        channel="onset", phase="onset", names=("dwell", "run", "x", "load"), covariates=("dwell", "run", "x", "load"),
        columns=columns, residual=slope * columns[:, 1] + rng.normal(0.0, 0.05, rows),
        known=np.ones(rows, dtype=np.bool_), run=np.arange(rows),
    )  # fmt: skip


def test_every_file_is_a_rival_and_every_absent_one_has_a_reason():
    assert rivals().keys() == {"refit_mu", "best_bic", "pysindy", "gaussian_process"}
    assert all(reasons().values())
    assert NOT_HERE.keys() <= reasons().keys()


def testsparse_regression_finds_the_planted_term_and_nothing_in_noise():
    pytest.importorskip("pysindy")
    from station.prove.rivals.pysindy_terms import sparse  # noqa: PLC0415  (needs the package)

    rng = np.random.default_rng(2)
    everything = np.ones(240, dtype=np.bool_)
    found = sparse(planted(rng, slope=0.06), everything)
    assert np.argmax(np.abs(found)) == 1
    assert found[1] == pytest.approx(0.06, abs=0.01)
    assert not np.any(sparse(planted(rng, slope=0.0), everything))


def test_a_gaussian_process_finds_the_covariate_that_matters():
    pytest.importorskip("sklearn")
    from station.prove.rivals.gaussian_process import LEAST, important, length_scales  # noqa: PLC0415  (needs the package)

    for slope, matters in ((0.08, True), (0.0, False)):
        rng = np.random.default_rng(2)
        terms = planted(rng, slope=slope)
        size, where = important(terms, length_scales(terms, rng), rng)
        assert (size > LEAST and where == ("onset", "run")) is matters


def test_the_rivals_are_scored_on_the_same_cases():
    case = truth("single", concealed("viscous"))
    right = {"gain": 0.4, "se": 0.1, "names": ["viscous"], "place": ["slide", "slide_time"]}
    refit = {
        "oracle": {"gain": 0.5, "se": 0.05}, "tool": {"gain": 0.45, "se": 0.1},
        "rivals": {"pysindy": right, "best_bic": {"fault": "ValueError: no"}, "refit_mu": {"gain": 0.0, "names": []}},
    }  # fmt: skip
    answer = said(claim("viscous"), located=(place("slide", "speed"),))
    lines = {line.title: line for line in versus([scored(case, answer, **refit)], {})}
    tool, sindy = lines["station diagnose"], lines["sparse regression (PySINDy)"]
    assert (tool.name.value, tool.place.value, tool.gap.value) == (1.0, 1.0, pytest.approx(0.9))
    assert (sindy.name.value, sindy.place.value, sindy.gap.value) == (1.0, 0.0, pytest.approx(0.8))
    assert "failed on 1 of 1" in lines["best single term by BIC"].note
    assert lines["refit mu only"].gap.value == 0.0
    assert math.isnan(lines["refit mu only"].name.value)
    assert "mujoco.sysid" in lines

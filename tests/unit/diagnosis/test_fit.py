"""The fit finds its maximum from wherever a search begins."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from station.diagnosis.inference.climb import CONVERGED, Climb
from station.diagnosis.inference.fit import MOST_STEPS, fit, stepped
from station.diagnosis.inference.level import levelled
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.table import table_evidence
from station.physics.catalogue import catalogue
from station.physics.model import Model, Term
from tests.unit.diagnosis.tables import MU, samples

FALL, RUNS = 0.15, 20.0
"""Wear of this size is planted, and settles early in the session."""

SCATTER = 0.09


def _worn() -> Evidence:
    """Returns 200 runs in which friction wears, with a scatter that makes the search hard."""
    rng = np.random.default_rng(2)
    left = [(1.0 + FALL * math.expm1(-run / RUNS)) * math.exp(rng.normal(0.0, SCATTER)) for run in range(200)]
    made = [
        replace(one, onset_angle_rad=math.atan(math.tan(one.onset_angle_rad) * share))
        for one, share in zip(samples(runs=200), left, strict=True)
    ]
    return table_evidence(made, Setting())


@pytest.mark.parametrize(
    "begun", [{"fall": -0.05, "runs": 50.0}, {"fall": 0.4, "runs": 600.0}, {"fall": 0.3, "runs": 10.0}]
)
def test_wear_is_found_wherever_the_search_begins(begun: dict[str, float]) -> None:
    """The likelihood at the end is that of a search that begins at what was planted."""
    evidence, wear = _worn(), catalogue()["wear"]
    null = fit(evidence, levelled(evidence, Model(mu_s=MU)), ())

    def found(start: dict[str, float]) -> float:
        return fit(evidence, null.model.with_term(Term(wear, start)), [wear], noise=null.noise).log_likelihood

    near = found({"fall": FALL, "runs": RUNS})
    assert found(begun) == pytest.approx(near, abs=0.2)


def test_steps_by_slopes_of_the_last_one_end_at_the_maximum() -> None:
    """New slopes, taken where a fit ended, lead nowhere: it has not stopped short by trusting those it had."""
    evidence, wear = _worn(), catalogue()["wear"]
    null = fit(evidence, levelled(evidence, Model(mu_s=MU)), ())
    ended = fit(evidence, null.model.with_term(Term(wear, {"fall": 0.3, "runs": 10.0})), [wear], noise=null.noise)
    again = Climb(evidence, ended.model, ended.free, noise=ended.noise)
    assert again.climb(MOST_STEPS, CONVERGED)
    assert again.log_likelihood - ended.log_likelihood < 2.0 * CONVERGED
    assert np.abs(again.point.vector - ended.vector) / np.sqrt(np.diag(ended.covariance)) == pytest.approx(0.0, abs=0.1)


def test_the_first_step_takes_the_other_numbers_along_and_keeps_shapes() -> None:
    """Most of 200 runs are worn: with mu where it was, all of the fall at once would be less likely than none."""
    evidence, wear = _worn(), catalogue()["wear"]
    null = fit(evidence, levelled(evidence, Model(mu_s=MU)), ())

    def likely(model: Model) -> float:
        return Climb(evidence, model, null.free, noise=null.noise).log_likelihood

    small = null.model.with_term(Term(wear, {"fall": 1e-3, "runs": RUNS}))
    begun = stepped(evidence, small, [wear], noise=null.noise, held={"wear"})
    (values,) = (term.values for term in begun.terms if term.effect.id == "wear")
    assert values["runs"] == RUNS
    assert values["fall"] == pytest.approx(FALL, abs=0.05)
    assert begun.mu_s > 1.05 * null.model.mu_s
    assert likely(begun) > likely(null.model) + 1.0 > likely(replace(begun, mu_s=null.model.mu_s)) + 1.0

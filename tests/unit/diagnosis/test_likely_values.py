"""A plan promises what its sessions tell on average over the values that the recording leaves likely."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest

from station.diagnosis.inference.fit import Fit
from station.diagnosis.next_experiment.choice import Bench, sessions
from station.diagnosis.next_experiment.likely_values import likely_values
from station.diagnosis.next_experiment.on_paper import NOISE, on_paper, standard
from station.diagnosis.next_experiment.outlook import Question, Rival, all_candidates, drawn, outlook
from station.physics.catalogue import catalogue
from station.physics.model import Model, Term

WEAR = catalogue()["wear"]
LIKELIEST = Rival(Term(WEAR, {"fall": 0.2, "runs": 20.0}), weight=0.8)


class Fitted:
    """A fit of wear, of which only this law's numbers and their covariance are asked."""

    def __init__(self, *sds: float) -> None:
        self.sds = np.array(sds)

    def of_effect(self, effect_id: str) -> tuple[Any, Any]:
        assert effect_id == "wear"
        return WEAR.parameters, np.outer(self.sds, self.sds) * np.array([[1.0, 0.6], [0.6, 1.0]])


def values(*sds: float) -> list[Rival]:
    return list(likely_values(cast("Fit", Fitted(*sds)), LIKELIEST))


def test_they_have_the_mean_and_the_covariance_of_the_fit_and_begin_with_the_likeliest() -> None:
    several = values(0.01, 3.0)
    found = np.array([[one.term.values["fall"], one.term.values["runs"]] for one in several])
    weights = np.array([one.weight for one in several])
    assert several[0].term == LIKELIEST.term
    assert weights.sum() == pytest.approx(LIKELIEST.weight)
    np.testing.assert_allclose(np.average(found, axis=0, weights=weights), [0.2, 20.0], rtol=1e-9)
    np.testing.assert_allclose(np.cov(found.T, aweights=weights, ddof=0), [[1e-4, 0.018], [0.018, 9.0]], rtol=1e-9)


def test_none_is_beyond_the_bounds_of_its_law() -> None:
    runs = [one.term.values["runs"] for one in values(0.01, 60.0)]
    assert min(runs) == WEAR.parameters[1].low


def test_a_size_that_is_hardly_known_promises_less() -> None:
    """Sessions long enough for the likeliest size are too short for the smaller ones."""
    bench = Bench(recorded=on_paper(standard(np.random.default_rng(3), 120), mu_s=0.4))

    def power(sd: float) -> float:
        asked = Question(
            rivals=tuple(values(sd, 1e-9)), ids=("wear",), beside=Model(mu_s=0.4), noise=NOISE, effects=(WEAR,)
        )
        trials = sessions(asked, bench, (), runs=120, look=all_candidates)
        return outlook(drawn(trials, runs=120, rng=np.random.default_rng(1)), [("wear",)]).power

    known, unknown = power(1e-9), power(0.1)
    assert known > 0.9
    assert unknown < known - 0.1

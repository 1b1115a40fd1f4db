"""A difference that has no name is called `other`, and one that has a name is called by it."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import tomli_w

from shared.messages import Sample
from station.diagnosis.diagnose import examined
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.table import table_evidence
from station.diagnosis.result import Diagnosis
from station.diagnosis.search.smooth import covariate_of, smooth_terms
from station.physics.catalogue import catalogue
from station.physics.model import Term, model_of_table
from station.physics.smooth import is_smooth
from tests.contracts.effect_states import contacts
from tests.unit.diagnosis.tables import samples

RUNS = 150


def scaled(table: list[Sample], factor: np.ndarray) -> list[Sample]:
    """The same onsets with friction times `factor` (n,)."""
    return [
        replace(one, onset_angle_rad=math.atan(math.tan(one.onset_angle_rad) * float(by)))
        for one, by in zip(table, factor, strict=True)
    ]


PHASE = np.arange(RUNS) * 2 * math.pi / 60


@cache
def swinging() -> Diagnosis:
    """Returns the diagnosis of friction that swings with the run number."""
    return examined(scaled(samples(runs=RUNS), 1.0 + 0.12 * np.sin(PHASE)), catalogue()).diagnosis


def test_friction_that_swings_with_the_run_number_has_no_name() -> None:
    found = swinging()
    assert found.effects[0].id == "other"
    assert found.other_probability > 0.9
    assert ("onset", "run") in {(place.phase, place.covariate) for place in found.located}
    assert found.fit.log_score_gain > 3 * found.fit.gain_se


def test_a_steady_drift_is_called_wear_and_not_other() -> None:
    found = examined(scaled(samples(runs=RUNS), np.linspace(1.0, 0.8, RUNS)), catalogue()).diagnosis
    assert "wear" in found.effects[0].class_ids
    assert found.effects[0].id != "other"


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_where_nothing_is_hidden_nothing_is_called_other(seed: int) -> None:
    found = examined(samples(runs=RUNS, seed=seed), catalogue()).diagnosis
    assert found.effects == ()


def test_every_smooth_term_vanishes_at_its_null() -> None:
    evidence = table_evidence(samples(), Setting())
    onset = evidence.channel("onset")
    assert onset is not None
    terms = smooth_terms(evidence)
    assert {effect.id.partition(",")[0] for effect in terms} >= {"other:run", "other:direction", "other:position"}
    contact = onset.moments.reported  # pyright: ignore[reportAttributeAccessIssue]  # the onset channel has moments
    for effect in terms:
        values = Term(effect, effect.neutral()).values
        assert effect.is_null(values)
        assert np.all(np.asarray(effect.friction(contact, values)) == 1.0)
        push = effect.push(contact, values)
        assert push is None or not push.any()


def test_what_has_no_name_is_in_the_model_that_simulators_take() -> None:
    model = model_of_table(tomllib.loads(tomli_w.dumps(dict(swinging().model))), catalogue())
    unnamed = [term for term in model.terms if is_smooth(term.effect)]
    assert [covariate_of(term.effect) for term in unnamed] == ["run"]
    contact = replace(contacts(RUNS), run=np.arange(float(RUNS)), moving=np.zeros(RUNS, dtype=bool))
    swing = np.log(np.asarray(unnamed[0].effect.friction(contact, unnamed[0].values)))
    assert np.corrcoef(swing, np.sin(PHASE))[0, 1] > 0.9
    assert np.std(swing) == pytest.approx(0.12 / math.sqrt(2), rel=0.25)

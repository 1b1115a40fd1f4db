"""What has no name is called so, and what has one is called by it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from shared.messages import Sample
from station.gap.diagnose import diagnose
from station.gap.evidence.evidence import Setting
from station.gap.evidence.table import table_evidence
from station.gap.smooth import smooth_terms
from station.physics.catalogue import catalogue
from station.physics.model import Term
from tests.unit.gap.tables import samples

RUNS = 150


def scaled(table: list[Sample], factor: np.ndarray) -> list[Sample]:
    """The same onsets with friction times `factor` (n,)."""
    return [
        replace(one, onset_angle_rad=math.atan(math.tan(one.onset_angle_rad) * float(by)))
        for one, by in zip(table, factor, strict=True)
    ]


def test_friction_that_swings_with_the_run_number_has_no_name() -> None:
    phase = np.arange(RUNS) * 2 * math.pi / 60
    found = diagnose(scaled(samples(runs=RUNS), 1.0 + 0.12 * np.sin(phase)), catalogue())
    assert found.effects[0].id == "other"
    assert found.other_probability > 0.9
    assert ("onset", "run") in {(place.phase, place.covariate) for place in found.located}
    assert found.fit.log_score_gain > 3 * found.fit.gain_se


def test_a_steady_drift_is_called_wear_and_not_other() -> None:
    found = diagnose(scaled(samples(runs=RUNS), np.linspace(1.0, 0.8, RUNS)), catalogue())
    assert "wear" in found.effects[0].class_ids
    assert found.effects[0].id != "other"


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_where_nothing_is_hidden_nothing_is_called_other(seed: int) -> None:
    found = diagnose(samples(runs=RUNS, seed=seed), catalogue())
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

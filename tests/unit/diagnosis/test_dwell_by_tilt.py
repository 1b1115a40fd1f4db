"""A block's dwell is what the protocol chose where a model asks, and what happened where a slide asks."""

from __future__ import annotations

import numpy as np
import pytest

from station.diagnosis.observations.dwell_by_tilt import GRID_RAD, DwellByTilt
from station.diagnosis.observations.onsets import Onsets
from station.physics.catalogue import catalogue
from station.physics.model import Model, Term
from tests.recovery.test_parameters import evidence

MU = 0.35
AGEING = {"per_decade": 0.3, "sliding_age_log10_s": 0.0}


def test_each_run_is_asked_at_its_own_tilt() -> None:
    """Ten and twenty seconds for each radian."""
    dwell_by_tilt = DwellByTilt(np.outer([10.0, 20.0], GRID_RAD), typical_rad=0.3)
    np.testing.assert_allclose(dwell_by_tilt.at(np.array([0.2, 0.123])), [2.0, 2.46])
    np.testing.assert_allclose(dwell_by_tilt.typical(), [3.0, 6.0])
    np.testing.assert_allclose(dwell_by_tilt.of([1]).at(0.5), [10.0])


@pytest.mark.parametrize("seed", [1, 2])
def test_a_slide_is_that_of_a_block_that_rested_until_it_slid(seed: int) -> None:
    """A run that holds longer has aged longer: its own draw is less than what its onset has over the model's.

    Were it taken for all of that, slides of runs that held long would seem too easy by what the block aged meanwhile.
    """
    ageing = catalogue()["contact_aging"]
    truth = Model(mu_s=MU, scatter=0.12).with_term(Term(ageing, ageing.neutral() | AGEING))
    seen = evidence(truth, np.random.default_rng(seed))
    onset, along = seen.channel("onset"), seen.channel("along")
    assert isinstance(onset, Onsets)
    assert along is not None
    run_effects, over = onset.run_effects(truth, seen.runs)
    apart = along.residual(truth) - over[along.rows.run]
    known = run_effects[along.rows.run] != 0.0
    slope = np.polyfit(run_effects[along.rows.run][known], apart[known], 1)[0]
    assert abs(slope) < 0.03, slope
    assert np.polyfit(run_effects[run_effects != 0.0], over[run_effects != 0.0], 1)[0] > 1.05

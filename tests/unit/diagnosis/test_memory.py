"""A run's memory of the one before belongs to that run, whatever number the recording's first run has."""

from __future__ import annotations

import numpy as np
import pytest

from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.onsets import Onsets
from station.diagnosis.observations.setting import Setting
from station.diagnosis.search.smooth import smooth_terms
from station.physics.smooth import Smooth
from tests.unit.diagnosis import recorded

SETTING = Setting(opening_radius_m=recorded.OPENING_RADIUS_M)


@pytest.mark.parametrize("first", [0, 700])
def test_a_term_by_run_reads_what_its_own_run_remembers(first: int) -> None:
    """A recording from somewhere else may count from 1: the terms once read the run after."""
    evidence = evidence_of(recorded.joined([recorded.session()], first_run=first), SETTING)
    onset = evidence.channel("onset")
    assert isinstance(onset, Onsets)
    assert evidence.run_number.min() == 1 + first
    remembering = [term for term in smooth_terms(evidence) if isinstance(term, Smooth) and term.by_run]
    assert {term.covariate for term in remembering} >= {"turned", "previous_slide"}
    for term in remembering:
        assert term.by_run
        np.testing.assert_array_equal(
            term.by_run(onset.moments.reported), onset.rows.covariates[term.covariate], err_msg=term.id
        )

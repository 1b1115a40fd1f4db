"""Runs that ended without a slide: what a limit tells of a number, and that one far below tells nothing."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from station.diagnosis import thresholds
from station.diagnosis.inference.columns import Scores, scores
from station.diagnosis.inference.fit import fit
from station.diagnosis.likelihood.student import expected_information, pulls
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.table import table_evidence
from station.physics.catalogue import catalogue
from station.physics.contact import Array
from station.physics.model import Model
from tests.unit.diagnosis.tables import MU, samples

GAUSSIAN = np.array([thresholds.GAUSSIAN])
GRAIN = catalogue()["plate_anisotropy"]


@pytest.mark.parametrize("limit", [-6.0, -1.0, 0.0, 2.0])
def test_a_limit_tells_what_its_probability_does(limit: float) -> None:
    """The information is compared with the second difference of the log probability to lie beyond the limit."""
    limits, step = np.array([True]), 1e-3
    _, curvature = pulls(np.array([limit]), GAUSSIAN, limits)
    near = norm.logsf([limit - step, limit, limit + step])
    told = float(expected_information(curvature, GAUSSIAN, limits)[0])
    assert told == pytest.approx(-(near[0] - 2.0 * near[1] + near[2]) / step**2, rel=1e-3, abs=1e-5)


def scored_with(stopped: int, *, share: float) -> Scores:
    """The scores of a table with `stopped` runs that ended at a share of the friction, each in its own direction."""
    table = samples(grain=0.02)
    for number, sample in enumerate(table[:stopped]):
        still = math.atan(share * MU)
        table.append(replace(sample, run=1000 + number, onset_angle_rad=still, censored=True))
    evidence = table_evidence(table, Setting())
    assert evidence.onsets is not None
    assert evidence.onsets.rows.limit.sum() == stopped
    return scores(evidence, fit(evidence, Model(mu_s=MU), ()), [GRAIN])


def known(scored: Scores) -> Array:
    """The information of the grain along the directions; that across is absorbed."""
    return np.diag(scored.information)[:1]


def test_runs_that_were_stopped_far_below_their_friction_tell_nothing() -> None:
    assert np.allclose(known(scored_with(40, share=0.5)), known(scored_with(0, share=0.5)), rtol=1e-6)


def test_runs_that_were_stopped_near_it_tell_something() -> None:
    without, with_them = known(scored_with(0, share=1.0)), known(scored_with(40, share=1.0))
    assert np.all(with_them > 1.1 * without)
    assert np.all(with_them < 1.6 * without)

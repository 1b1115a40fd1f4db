"""The wander of friction along slides is read from residuals in which it was planted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from station.diagnosis.likelihood.noise import estimate_noise
from station.diagnosis.likelihood.wander import Wander, minus_log_likelihood, wanders
from station.diagnosis.likelihood.whitening import Whitening, stack
from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.setting import Setting
from station.physics.contact import Array
from tests.unit.diagnosis.recorded import OPENING_RADIUS_M, session

LEVEL, NOISE = 0.08, 3.0
"""Scatter of the runs' friction, and the windows' noise over what they say of it."""


def _evidence() -> Evidence:
    return evidence_of(session(), Setting(opening_radius_m=OPENING_RADIUS_M))


def _drawn(evidence: Evidence, planted: Wander, rng: np.random.Generator) -> dict[str, Array]:
    """Residuals of the friction along the slides: each run's level, its wander, the windows' noise; 0 elsewhere."""
    drawn = {channel.name: rng.normal(0.0, channel.rows.sigma) for channel in evidence.channels}
    along = evidence.channel("along")
    assert along is not None
    assert along.travelled_m is not None
    values = rng.normal(0.0, NOISE * along.rows.sigma)
    for run in np.unique(along.rows.run):
        mine = np.flatnonzero(along.rows.run == run)
        place = along.travelled_m[mine]
        shared = planted.shared(place[:, None] - place[None, :])
        values[mine] += rng.normal(0.0, LEVEL) + rng.multivariate_normal(np.zeros(len(mine)), shared)
    return drawn | {"along": values}


@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_what_was_planted_is_found(seed: int, smooth: bool) -> None:
    evidence = _evidence()
    found = wanders(evidence, _drawn(evidence, Wander(0.03, 5e-3, smooth), np.random.default_rng(seed)))["along"]
    assert 0.015 < found.sd < 0.06


@pytest.mark.parametrize("smooth", [False, True])
def test_the_filters_likelihood_is_that_of_the_gaussian(smooth: bool) -> None:
    """Two runs of five rows, each with a level and a process of its own."""
    rng, wander, own = np.random.default_rng(7), Wander(0.8, 2.0, smooth), 0.3
    place = np.concatenate([np.cumsum(rng.uniform(0.1, 3.0, 5)) for _ in range(2)])
    values, rows = rng.standard_normal(10), rng.uniform(0.1, 0.5, 10)
    starts = np.arange(10) % 5 == 0
    said = minus_log_likelihood(values, rows, place, starts, own**2, wander.sd**2, wander.reach_m, smooth)
    dense = 0.0
    for run in (slice(0, 5), slice(5, 10)):
        covariance = wander.shared(place[run, None] - place[None, run]) + own**2 + np.diag(rows[run])
        square = values[run] @ np.linalg.solve(covariance, values[run])
        dense += 0.5 * float(square + np.linalg.slogdet(covariance).logabsdet)
    assert said == pytest.approx(dense, rel=1e-9)


@pytest.mark.parametrize("smooth", [False, True])
def test_smooth_friction_is_told_from_rough(smooth: bool) -> None:
    """The likelier is mostly the right one, in sessions drawn of either."""
    evidence = _evidence()
    drawn = [_drawn(evidence, Wander(0.05, 6e-3, smooth), np.random.default_rng(seed)) for seed in range(8)]
    assert sum(wanders(evidence, one)["along"].smooth == smooth for one in drawn) >= 6


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_where_nothing_wanders_hardly_anything_is_found(seed: int) -> None:
    evidence = _evidence()
    found = wanders(evidence, _drawn(evidence, Wander(0.0, 5e-3), np.random.default_rng(seed)))["along"]
    assert found.sd < 0.006


def test_a_law_that_all_runs_share_is_no_wander() -> None:
    evidence = _evidence()
    along = evidence.channel("along")
    assert along is not None
    drawn = _drawn(evidence, Wander(0.0, 5e-3), np.random.default_rng(1))
    first = np.flatnonzero(np.diff(along.rows.run, prepend=-1))
    number = np.arange(len(along)) - np.repeat(first, np.diff(np.append(first, len(along))))
    found = wanders(evidence, drawn | {"along": drawn["along"] + 0.02 * number})["along"]
    assert found.sd < 0.01  # half of what the law changes from one window to the next


@pytest.mark.parametrize("planted", [Wander(0.05, 2e-2), Wander(0.05, 8e-3, smooth=True)])
def test_wander_is_whitened_away(planted: Wander) -> None:
    """Neighbouring windows of a run err alike before, and independently after."""
    evidence, both = _evidence(), list[float]()
    for wander in ({"along": planted}, {}):
        products = []
        for seed in range(20):
            drawn = _drawn(evidence, planted, np.random.default_rng(seed))
            whitening = Whitening(evidence, replace(estimate_noise(evidence, drawn), wander=wander))
            white = whitening(stack(evidence, drawn))
            mine = whitening.channel == [one.name for one in evidence.channels].index("along")
            values, run = white[mine], whitening.run[mine]
            same = run[1:] == run[:-1]
            products.append(float(np.mean((values[1:] * values[:-1])[same]) / np.mean(values**2)))
        both.append(float(np.mean(products)))
    assert abs(both[0]) < 0.15
    assert abs(both[0]) < abs(both[1])

"""The density of unseen runs: an outlier that no fitted run foretold costs what an outlier is worth, and no more."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy import stats

from station.diagnosis import thresholds
from station.diagnosis.inference.fit import Fit, fit
from station.diagnosis.likelihood.noise import TAILS
from station.diagnosis.likelihood.student import scale_of
from station.diagnosis.likelihood.whitening import Whitening
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.predict.folds import FOLDS
from station.diagnosis.predict.unseen import unseen_log_run
from station.physics.contact import Array
from tests.unit.diagnosis.test_held_out import plain_fit


@cache
def part() -> tuple[Evidence, Fit]:
    """A fit to four fifths of 24 runs, whose onsets have the Gaussian's tail, and the evidence of all."""
    evidence, plain = plain_fit()
    out = np.arange(evidence.runs) % FOLDS == 0
    found = fit(evidence.without(out), plain.model, (), noise=plain.noise)
    tail = {**found.noise.tail, "onset": thresholds.GAUSSIAN}
    return evidence.without(out), replace(found, noise=replace(found.noise, tail=tail))


def with_outlier(white: Array, evidence: Evidence, run: int, pull: float) -> Array:
    """The whitened residuals with one run's onset `pull` standard deviations off."""
    whitening = Whitening(evidence, part()[1].noise)
    return np.where((whitening.channel == 0) & (whitening.run == run), pull, white)


def test_an_unseen_outlier_costs_no_more_than_an_outlier_is_worth() -> None:
    evidence, found = part()
    far = replace(found, white=with_outlier(found.white, evidence, 0, 26.0))
    near = replace(found, white=with_outlier(found.white, evidence, 0, 1.0))
    lost = unseen_log_run(evidence, near)[0] - unseen_log_run(evidence, far)[0]
    assert 5.0 < lost < 20.0  # a Gaussian would lose 337 nat


def test_a_run_like_the_others_is_scored_nearly_as_under_the_likeliest_tail() -> None:
    evidence, found = part()
    assert unseen_log_run(evidence, found)[0] == pytest.approx(found.log_run[0], abs=3.0)


def test_it_is_the_mean_of_students_densities_by_what_the_fitted_runs_say_of_them() -> None:
    """Written out for the onsets with scipy: by so much a run's density differs if its onset alone does."""
    evidence, found = part()
    whitening = Whitening(evidence, found.noise)
    onset = whitening.channel == 0
    known = found.white[onset & evidence.counted[whitening.run] & ~whitening.limit]
    one, other = found.white[onset & (whitening.run == 0)][0], 4.0

    def density(value: float) -> float:
        laws: list[Any] = [stats.t(tail) if tail < thresholds.GAUSSIAN else stats.norm() for tail in TAILS]
        scales = [scale_of(known, tail) for tail in TAILS]
        each = [
            law.logpdf(known / scale).sum() - len(known) * np.log(scale)
            for law, scale in zip(laws, scales, strict=True)
        ]
        of_value = [law.logpdf(value / scale) - np.log(scale) for law, scale in zip(laws, scales, strict=True)]
        return float(np.logaddexp.reduce(np.add(each, of_value)) - np.logaddexp.reduce(each))

    moved = replace(found, white=with_outlier(found.white, evidence, 0, other))
    by = unseen_log_run(evidence, moved)[0] - unseen_log_run(evidence, found)[0]
    assert by == pytest.approx(density(other) - density(one), abs=1e-9)

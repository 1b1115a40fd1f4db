"""The sampler of small models, against integrals that are known."""

from __future__ import annotations

import numpy as np
import pytest

from station.diagnosis.inference.tempered import tempered
from station.physics.contact import Array

LOW, HIGH = np.array([-2.0, 0.0, 10.0]), np.array([3.0, 1.0, 50.0])


def test_a_normal_likelihood_has_its_evidence_mean_and_deviation() -> None:
    """Its evidence is its integral over the volume of the box; the third number is correlated with the first."""
    middle, inverse = np.array([0.5, 0.4, 30.0]), np.linalg.inv([[1e-4, 0.0, 4e-3], [0.0, 1e-3, 0.0], [4e-3, 0.0, 1.0]])

    def log_likelihood(draws: Array) -> Array:
        off = draws - middle
        return -0.5 * np.einsum("mi,ij,mj->m", off, inverse, off)

    found = tempered(log_likelihood, LOW, HIGH, np.random.default_rng(1))
    integral = 0.5 * np.log(np.linalg.det(2.0 * np.pi * np.linalg.inv(inverse)))
    assert found.log_evidence == pytest.approx(integral - np.log(np.prod(HIGH - LOW)), abs=0.5)
    sd = np.sqrt(np.diag(np.linalg.inv(inverse)))
    assert np.all(np.abs(found.mean() - middle) < 0.3 * sd)
    assert found.sd() == pytest.approx(sd, rel=0.25)


def test_two_maxima_keep_their_shares() -> None:
    """One of three parts of the weight lies at 0, two at 1."""

    def log_likelihood(draws: Array) -> Array:
        near, far = (-0.5 * ((draws[:, 0] - place) / 0.02) ** 2 for place in (0.0, 1.0))
        return np.logaddexp(near, np.log(2.0) + far)

    at_one = [
        (tempered(log_likelihood, LOW[:1], HIGH[:1], np.random.default_rng(seed)).draws > 0.5).mean()
        for seed in range(10)
    ]
    assert np.mean(at_one) == pytest.approx(2.0 / 3.0, abs=0.12)


def test_a_likelihood_that_knows_nothing_leaves_the_prior() -> None:
    """Numbers stay even between their bounds, and the evidence is that of the data."""
    found = tempered(lambda draws: np.full(len(draws), -3.0), LOW, HIGH, np.random.default_rng(2))
    assert found.log_evidence == pytest.approx(-3.0)
    assert found.mean() == pytest.approx((LOW + HIGH) / 2.0, rel=0.2)

"""A regression that keeps what the data ask for: nothing of noise, and next to all of what is there."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import multivariate_normal

from station.diagnosis.observations.relevance import relevant
from station.physics.contact import Array

SLIDES, SIGMA = 100, 0.01
WEIGHT = np.full(SLIDES, SIGMA**-2)
GROUP = np.r_[0, 1 + np.arange(12) // 2]


def waves(rng: np.random.Generator) -> Array:
    """A constant, and three harmonics of two angles: (SLIDES, 13)."""
    angles = rng.uniform(0.0, 2.0 * math.pi, (2, SLIDES))
    found = [function(k * angle) for angle in angles for k in (1, 2, 3) for function in (np.cos, np.sin)]
    return np.column_stack([np.ones(SLIDES), *found])


def fitted(design: Array, values: Array) -> Array:
    return np.asarray(np.linalg.lstsq(design, values, rcond=None)[0], dtype=np.float64)


def test_noise_has_no_waves() -> None:
    """Plain least squares are off by a third of the noise's standard deviation; most of that is gone."""
    rng = np.random.default_rng(20261127)
    kept, plain = np.zeros(60), np.zeros(60)
    for place in range(60):
        design, noise = waves(rng), rng.normal(0.0, SIGMA, SLIDES)
        kept[place] = np.mean((design @ relevant(design, noise, WEIGHT, GROUP)) ** 2)
        plain[place] = np.mean((design @ fitted(design, noise)) ** 2)
    assert np.sqrt(plain.mean()) == pytest.approx(SIGMA * math.sqrt(13 / SLIDES), rel=0.1)
    assert kept.mean() < 0.4 * plain.mean()


def test_a_wave_that_is_there_is_not_shrunk() -> None:
    rng = np.random.default_rng(20261128)
    design = waves(rng)
    truth = np.zeros(13)
    truth[3:5] = 0.05, -0.02
    found = relevant(design, design @ truth + rng.normal(0.0, SIGMA, SLIDES), WEIGHT, GROUP)
    assert found[3:5] == pytest.approx(truth[3:5], abs=3 * SIGMA / math.sqrt(SLIDES / 2))
    assert np.hypot(*found[3:5]) > 0.97 * np.hypot(*fitted(design[:, 3:5], design @ truth))


def test_the_variances_are_the_likeliest() -> None:
    """SciPy finds variances by the values' own likelihood, which give the same coefficients."""
    rng = np.random.default_rng(20261129)
    design = rng.normal(size=(40, 4))
    values = design @ [0.03, -0.02, 0.004, 0.001] + rng.normal(0.0, SIGMA, 40)
    normal: Any = multivariate_normal
    group, weight = np.array([0, 0, 1, 1]), np.full(40, SIGMA**-2)

    def loss(log_variance: Array) -> float:
        covariance = SIGMA**2 * np.eye(40) + (design * np.exp(log_variance)[group]) @ design.T
        return -float(normal(np.zeros(40), covariance).logpdf(values))

    best = np.exp(minimize(loss, np.log([1e-3, 1e-5]), method="Nelder-Mead", options={"xatol": 1e-6, "fatol": 1e-9}).x)
    known = np.linalg.solve(
        design.T @ (weight[:, None] * design) + np.diag(1.0 / best[group]), design.T @ (weight * values)
    )
    assert relevant(design, values, weight, group) == pytest.approx(known, rel=1e-3, abs=1e-6)


def test_the_same_columns_do_not_run_away() -> None:
    """Blocks that never turn slide along the same four lines in plate and block; the errors are told as too small."""
    rng = np.random.default_rng(3)
    line = 0.5 * math.pi * rng.integers(0, 4, SLIDES)
    off = np.where(rng.random(SLIDES) < 0.1, 0.2, 0.0) * rng.normal(size=SLIDES) + rng.normal(0.0, 0.003, SLIDES)
    angles = (line, line, line + off)
    waves = [function(k * angle) for angle in angles for k in (1, 2, 3, 4, 6) for function in (np.cos, np.sin)]
    design, truth = np.column_stack([np.ones(SLIDES), *waves]), -0.37 * np.sin(line)
    values = truth + rng.normal(0.0, 0.02, SLIDES)
    found = relevant(design, values, np.full(SLIDES, 1e5), np.r_[0, 1 + np.arange(30) // 2])
    assert design @ found == pytest.approx(truth, abs=0.06)

"""The errors that onsets state where the observation is not as the fit takes it: they hold there, too."""

from __future__ import annotations

import math

import numpy as np
import pytest

from station.friction.onset_errors import Residuals
from station.friction.onset_loads import Array
from tests.unit.friction.slides import measure, slide

RUNS = 40
COUNT = 2000


def pulls(
    seed: int, *, rate_deg_s: float = 5.0, drop: float = 0.0, jitter_s: float = 0.0, stuck_s: float = 0.0
) -> tuple[float, float]:
    """Returns the rms of onsets' errors, deg, and of those over the stated ones; encoders are stuck anywhere nearby."""
    rng, off, pull = np.random.default_rng(seed), list[float](), list[float]()
    for onset_rad in rng.uniform(math.radians(12), math.radians(28), RUNS):
        truth = slide(float(onset_rad), rate_deg_s=rate_deg_s, drop=drop)
        stuck = (float(rng.uniform(-0.12, 0.15)), stuck_s)
        found = measure(truth, noise_px=0.03, rng=rng, jitter_s=jitter_s, stuck_s=stuck)
        assert found is not None
        off.append(math.degrees(found.angle_rad - truth.onset_rad))
        pull.append(off[-1] / math.degrees(found.angle_sigma_rad))
    return math.sqrt(np.mean(np.square(off))), math.sqrt(np.mean(np.square(pull)))


@pytest.mark.parametrize("drop", [0.0, 0.2])
@pytest.mark.parametrize("stuck_s", [0.05, 0.1])
def test_encoders_that_are_stuck_for_a_moment_spoil_no_onset(stuck_s: float, drop: float) -> None:
    """Onsets were off by 0.12 degrees, and by forty times what they stated, in the rms."""
    off_deg, pull = pulls(1, stuck_s=stuck_s, drop=drop)
    assert off_deg < 0.01
    assert 0.4 < pull < 1.4


@pytest.mark.parametrize(("jitter_s", "rate_deg_s"), [(0.001, 5.0), (0.003, 1.0), (0.003, 5.0), (0.003, 10.0)])
def test_stamps_that_jitter_make_the_stated_error_larger(jitter_s: float, rate_deg_s: float) -> None:
    """Onsets were off by three times what they stated, in the rms, with 3 ms."""
    _, pull = pulls(2, jitter_s=jitter_s, rate_deg_s=rate_deg_s)
    assert 0.7 < pull < 1.4


def residuals(residual_m: Array, *, speed_m_s: float = 0.1) -> Residuals:
    """Residuals of a slide of which nothing is fitted, after as many frames at rest."""
    moving = np.arange(2 * COUNT) >= COUNT
    slope: Array = moving.astype(np.float64)
    return Residuals(residual_m, np.where(moving, speed_m_s, 0.0), slope, np.zeros(2 * COUNT), moving)


def test_what_was_expected_is_stated() -> None:
    noise = 1e-5 * np.random.default_rng(3).standard_normal(2 * COUNT)
    assert residuals(noise).error_m(1e-5) == pytest.approx(1e-5, rel=0.07)


def test_a_noise_that_proves_larger_at_rest_is_that_of_the_slide() -> None:
    noise = 1e-5 * np.random.default_rng(3).standard_normal(2 * COUNT)
    assert residuals(noise).error_m(1e-6) == pytest.approx(1e-5, rel=0.07)


def test_what_jitters_is_as_large_as_its_speed_makes_it() -> None:
    rng = np.random.default_rng(3)
    found = residuals(1e-5 * rng.standard_normal(2 * COUNT))
    jitter = 0.003 * found.speed_m_s * rng.standard_normal(2 * COUNT)
    assert residuals(found.residual_m + jitter).error_m(1e-5) == pytest.approx(3e-4, rel=0.1)


def test_residuals_that_resemble_their_neighbours_count_for_fewer() -> None:
    """A block of ten equal residuals is worth one of them: the error of the mean is √10 times as large."""
    rng = np.random.default_rng(3)
    alike = np.repeat(rng.standard_normal(COUNT // 5), 10) * np.where(np.arange(2 * COUNT) < COUNT, 1e-6, 1e-4)
    stated = residuals(alike, speed_m_s=0.0).error_m(1e-6)
    assert 2.0e-4 < stated < 5.0e-4

"""Rates that a driver has filtered, and the attitude that undoes it: against lags that are known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import lfilter

from shared.geometry import Array
from station.diagnosis.observations.attitude_fit import AttitudeFit, fitted
from station.diagnosis.observations.rate_filter import REACH_S, answered, weights

HZ, FINE_S, STEP_S, STEPS = 100.0, 5e-4, 0.4037, 300
RING_RAD_S, DAMPED = 2.0 * math.pi * 14.0, 0.25
RATE_NOISE_RAD_S = 5e-3


def white(seed: int, count: int = 5000) -> Array:
    return np.random.default_rng(seed).standard_normal((count, 2))


def test_a_lag_of_first_order_is_its_time_constant() -> None:
    rate = white(1)
    weight = weights(0.04 * rate + 1e-6 * white(2), rate, 1.0 / HZ)
    middle = len(weight) // 2
    assert middle == round(REACH_S * HZ)
    assert weight[middle] == pytest.approx(0.04, rel=1e-3)
    assert np.abs(np.delete(weight, middle)).max() < 1e-6


def test_what_has_no_part_in_the_attitude_gets_no_weight() -> None:
    """21 weights of a regression on noise would be 1 / sqrt(2 n) = 0.01 each."""
    assert np.abs(weights(white(1), white(2), 1.0 / HZ)).max() < 2e-3


def test_rates_of_an_arm_that_rests_have_no_weight() -> None:
    assert not weights(white(1), np.zeros((5000, 2)), 1.0 / HZ).any()


def test_parts_are_answered_on_their_own() -> None:
    """The first part goes on as it ends, whatever the second is."""
    slope = np.concatenate([np.full((50, 2), 2.0), np.full((30, 2), -1.0)])
    found = answered(slope, np.array([0.1, 0.3, 0.2]), [slice(0, 50), slice(50, 80)])
    assert np.allclose(found[:50], 1.2)
    assert np.allclose(found[50:], -0.6)


def ringing(lag_s: float) -> tuple[Array, Array, Array]:
    """Tilts, rates, and rates behind a lag of first order, of an arm that rings after each step, 100 times a second."""
    length_s = (STEPS - 0.25) * STEP_S
    moving = np.clip(np.arange(-0.5, length_s + 0.5, FINE_S), 0.0, length_s)  # it rests before and after
    phase = np.clip(np.mod(moving, STEP_S) / 0.2, 0.0, 1.0)
    step = np.floor(moving / STEP_S)
    up = np.where(np.mod(step, 24) < 12, 1.0, -1.0)
    begun = np.where(np.mod(step, 24) < 12, np.mod(step, 24), 24 - np.mod(step, 24))
    asked = math.radians(2.0) * (begun + up * phase**3 * (10.0 - 15.0 * phase + 6.0 * phase**2))
    turn, damping = RING_RAD_S * FINE_S, 2.0 * DAMPED * RING_RAD_S * FINE_S
    tilt = lfilter([turn**2], [1.0, damping + turn**2 - 2.0, 1.0 - damping], asked)
    rate = np.gradient(tilt, FINE_S)
    late = lfilter([FINE_S / lag_s], [1.0, FINE_S / lag_s - 1.0], rate)
    every = round(1.0 / (HZ * FINE_S))
    return np.asarray(tilt)[::every], rate[::every], np.asarray(late)[::every]


def fit_of(noise_rad: float, rate_noise_rad_s: float) -> tuple[AttitudeFit, Array, Array]:
    """The fit behind a lag of 40 ms, and by how much its gravity (n, 2) and its rates about the axis (n,) err."""
    tilt, rate, late = ringing(0.04)
    true = np.column_stack([np.sin(tilt), 0.0 * tilt, -np.cos(tilt)])
    rng = np.random.default_rng(20261441)
    read = true + noise_rad * rng.standard_normal(true.shape)
    read /= np.linalg.norm(read, axis=1, keepdims=True)
    none = np.zeros_like(rate)
    rates = np.column_stack([none, late, none]) + rate_noise_rad_s * rng.standard_normal(true.shape)
    fit = fitted(np.arange(len(tilt)) / HZ, read, rates)
    return fit, (fit.gravity - true)[:, :2], fit.rate_rad_s[:, 1] - rate


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def test_a_ringing_arm_behind_a_lag_is_as_well_known_as_its_noise_allows() -> None:
    """With mean and variance of the delay alone the errors were twice as large, those of the rates as well."""
    fit, gravity, rate = fit_of(4e-4, RATE_NOISE_RAD_S)
    assert fit.noise_rad == pytest.approx(4e-4, rel=0.03)
    assert rms(gravity[:, 0]) < 1.15 * rms(gravity[:, 1])
    assert rms(gravity) == pytest.approx(float(np.median(fit.sigma_rad)), rel=0.25)
    assert rms(rate) < 1.6 * RATE_NOISE_RAD_S


def test_good_readings_get_better_by_lagging_rates() -> None:
    """With mean and variance of the delay alone the readings counted as exact: their error was said to be 3e-7."""
    fit, gravity, _ = fit_of(1e-5, 1e-5)
    assert fit.noise_rad == pytest.approx(1e-5, rel=0.2)
    assert rms(gravity) < 6e-6
    assert rms(gravity) == pytest.approx(float(np.median(fit.sigma_rad)), rel=0.25)

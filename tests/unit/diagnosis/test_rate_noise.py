"""Noise of recorded rates is taken out where the plate's motion lets it, and nothing else is."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import lfilter

from shared.geometry import Array
from station.diagnosis.observations import rate_noise
from station.diagnosis.observations.cubics import spline_slopes
from station.diagnosis.observations.rate_noise import without_noise

HZ, FINE_S, STEP_S, STEPS = 100.0, 5e-4, 0.8037, 80
RING_RAD_S, DAMPED = 2.0 * math.pi * 14.0, 0.35


def ringing_rate() -> Array:
    """The rates (n, 3), rad/s, of an arm that moves by two degrees in 0.2 s, rings, and rests."""
    time_s = np.arange(0.0, STEPS * STEP_S, FINE_S)
    phase = np.clip(np.mod(time_s, STEP_S) / 0.2, 0.0, 1.0)
    asked = math.radians(2.0) * (np.floor(time_s / STEP_S) + phase**3 * (10.0 - 15.0 * phase + 6.0 * phase**2))
    turn, damping = RING_RAD_S * FINE_S, 2.0 * DAMPED * RING_RAD_S * FINE_S
    tilt = lfilter([turn**2], [1.0, damping + turn**2 - 2.0, 1.0 - damping], asked)
    rate = np.gradient(np.asarray(tilt), FINE_S)[:: round(1.0 / (HZ * FINE_S))]
    return np.column_stack([rate, -0.5 * rate, 0.0 * rate])


def noisy(noise_rad_s: float, seed: int = 5) -> Array:
    rate = ringing_rate()
    return rate + noise_rad_s * np.random.default_rng(seed).standard_normal(rate.shape)


def accelerations(rate: Array) -> Array:
    return spline_slopes(np.arange(len(rate)) / HZ, rate)[:, 0]


def acceleration_error(rate: Array) -> float:
    """Root mean square (rad/s^2) while the arm is accelerated."""
    true = accelerations(ringing_rate())
    return float(np.sqrt(np.mean(np.square(accelerations(rate) - true)[np.abs(true) > 0.3])))


@pytest.mark.parametrize(("noise_rad_s", "ratio"), [(3e-4, 1.05), (1.3e-3, 0.97), (5e-3, 0.6)])
def test_the_noise_is_told_and_the_accelerations_get_better(
    noise_rad_s: float, ratio: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The more noise, the more there is to gain: steps of two degrees in a fifth of a second hide a little."""
    rate = noisy(noise_rad_s)
    assert rate_noise.resting_noise(rate) == pytest.approx(noise_rad_s, rel=0.1)
    before, after = acceleration_error(rate), acceleration_error(without_noise(rate))
    assert after < ratio * before
    for order in (2, 3):
        monkeypatch.setattr(rate_noise, "ORDER", order)
        print(f"\n{noise_rad_s:g} rad/s: {before:.3f}, with order 4 {after:.3f}", end="")
        print(f", with order {order} {acceleration_error(without_noise(rate)):.3f} rad/s^2", end="")


def test_the_penalty_is_near_the_best() -> None:
    """No penalty of a grid makes the error smaller by more than a twentieth."""
    rate = noisy(1.3e-3)
    smoothed = rate_noise.smoothed
    best = min(acceleration_error(smoothed(rate, penalty)) for penalty in np.geomspace(1e-4, 1e2, 25))
    assert acceleration_error(without_noise(rate)) < 1.15 * best


@pytest.mark.parametrize("clear", [2.0, 8.0])
def test_where_the_plate_counts_as_accelerated_matters_little(clear: float, monkeypatch: pytest.MonkeyPatch) -> None:
    before = acceleration_error(without_noise(noisy(5e-3)))
    monkeypatch.setattr(rate_noise, "CLEAR", clear)
    after = acceleration_error(without_noise(noisy(5e-3)))
    print(f"\nCLEAR {clear:g}: {after:.3f} rad/s^2, {before:.3f} as it is")
    assert after == pytest.approx(before, rel=0.15)


def test_exact_rates_stay_as_they_are() -> None:
    rate = ringing_rate()
    assert without_noise(rate) is rate
    assert without_noise(np.zeros((500, 3))) is not None
    few = np.random.default_rng(1).standard_normal((7, 3))
    assert without_noise(few) is few


def test_noise_alone_is_taken_out() -> None:
    """Nothing but a slow wander is left of it."""
    still = 1e-3 * np.random.default_rng(2).standard_normal((3000, 3))
    assert without_noise(still).std() < 0.4 * still.std()


def test_polynomials_below_the_order_pass() -> None:
    time_s = np.linspace(0.0, 1.0, 200)
    cubic = np.column_stack([time_s**3 - time_s, 2.0 * time_s**2, 1.0 + time_s])
    smoothed = rate_noise.smoothed(cubic, 100.0)
    assert np.abs(smoothed - cubic).max() < 1e-9


def test_the_gain_of_steps_is_their_trace_by_the_number_of_readings() -> None:
    count, penalty = 1500, 0.7
    smoother = rate_noise.smoothed(np.eye(count), penalty)
    gain = rate_noise._gain_of_steps(penalty)  # pyright: ignore[reportPrivateUsage]
    assert np.trace(np.diff(np.diff(smoother, axis=0), axis=1)) / count == pytest.approx(gain, rel=0.02)
    assert rate_noise._gain_of_steps(0.0) == pytest.approx(2.0)  # pyright: ignore[reportPrivateUsage]


def test_the_quantile_of_noise_alone_is_what_is_said() -> None:
    noise = 2e-3 * np.random.default_rng(3).standard_normal((200_000, 3))
    assert rate_noise.resting_noise(noise) == pytest.approx(2e-3, rel=0.01)

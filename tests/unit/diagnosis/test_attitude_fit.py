"""Readings of the attitude and its rates, made to fit each other: noise and delay are told, and both are mended."""

from __future__ import annotations

import math

import numpy as np
import pytest

from shared.geometry import Array
from station.diagnosis.observations.attitude_fit import JUMPS, AttitudeFit, fitted
from station.diagnosis.observations.cubics import spline_integral

HZ, STEP_S, STEPS, MOVES_S = 100.0, 0.4037, 60, 0.237
RATE_RAD_S, ACCELERATION_RAD_S2, AZIMUTH_RAD = math.radians(5.0), math.radians(200.0), 0.3
FINE_S = 1e-4


def course(filtered_s: float = 0.0) -> tuple[Array, Array, Array, Array]:
    """Times (n,), tilts, rates, and rates that are means over the time before: ten steps up, ten steps down."""
    fine = np.arange(-0.2, STEPS * STEP_S, FINE_S)
    phase = np.where(fine < 0.0, 0.0, np.mod(fine, STEP_S))
    ramp_s = RATE_RAD_S / ACCELERATION_RAD_S2
    rate = np.clip(np.minimum(phase - 0.0537, 0.0537 + MOVES_S - phase) / ramp_s, 0.0, 1.0) * RATE_RAD_S
    rate *= np.where(np.mod(np.floor(fine / STEP_S), 20) < 10, 1.0, -1.0)
    tilt = np.cumsum(rate) * FINE_S
    count = max(1, round(filtered_s / FINE_S))
    mean = np.convolve(rate, np.full(count, 1.0 / count))[: len(rate)]
    time_s = np.arange(0.0, STEPS * STEP_S - 0.05, 1.0 / HZ)
    at = [np.interp(time_s, fine, values) for values in (tilt, rate, mean)]
    return time_s, at[0], at[1], at[2]


def gravity_of(tilt: Array) -> Array:
    c, s = math.cos(AZIMUTH_RAD), math.sin(AZIMUTH_RAD)
    return np.column_stack([np.sin(tilt) * c, np.sin(tilt) * s, -np.cos(tilt)])


def rates_of(rate: Array) -> Array:
    c, s = math.cos(AZIMUTH_RAD), math.sin(AZIMUTH_RAD)
    return np.column_stack([-s * rate, c * rate, np.zeros_like(rate)])


def fit_of(*, noise_rad: float, filtered_s: float, seed: int = 20261320) -> tuple[AttitudeFit, Array, Array]:
    """The fit, and by how much its gravity (n, 2) and its rates (n, 3) err."""
    time_s, tilt, rate, mean = course(filtered_s)
    true = gravity_of(tilt)
    read = true + noise_rad * np.random.default_rng(seed).standard_normal(true.shape)
    read /= np.linalg.norm(read, axis=1, keepdims=True)
    fit = fitted(time_s, read, rates_of(mean))
    return fit, (fit.gravity - true)[:, :2], fit.rate_rad_s - rates_of(rate)


def test_what_is_exact_stays_as_it_is() -> None:
    fit, gravity, rate = fit_of(noise_rad=0.0, filtered_s=0.0)
    assert np.abs(gravity).max() < 2e-5
    assert np.abs(rate).max() < 2e-3  # at corners, of a hundredth of the acceleration for 10 ms
    assert fit.noise_rad < 1e-5
    assert abs(fit.delay_s) < 1e-4


@pytest.mark.parametrize("noise_rad", [4e-4, 1.6e-3])
@pytest.mark.parametrize("filtered_s", [0.0, 0.08])
def test_noise_and_delay_are_told_from_readings_and_rates_together(noise_rad: float, filtered_s: float) -> None:
    fit, gravity, _ = fit_of(noise_rad=noise_rad, filtered_s=filtered_s)
    assert fit.noise_rad == pytest.approx(noise_rad, rel=0.08)
    assert fit.delay_sd_s < 2.5e-3
    assert fit.delay_s == pytest.approx(0.5 * filtered_s, abs=4.0 * fit.delay_sd_s)
    assert np.sqrt(np.mean(gravity**2)) < 0.4 * noise_rad


def test_a_broken_line_errs_as_is_said() -> None:
    """A slope that jumps once in forty intervals, at any share of one: the spline's integral against the line's own."""
    rng = np.random.default_rng(1)
    corners = np.arange(20.0, 40_000.0, 40.0) + rng.random(1000)
    jumps, time_s = rng.standard_normal(1000), np.arange(40_000.0)
    edges = np.sort(np.concatenate([time_s, corners]))
    slope = np.concatenate([[0.0], np.cumsum(jumps)])[np.searchsorted(corners, edges[:-1], side="right")]
    line = np.concatenate([[0.0], np.cumsum(slope * np.diff(edges))])
    whole = np.concatenate([[0.0], np.cumsum(0.5 * (line[1:] + line[:-1]) * np.diff(edges))])
    kept = np.searchsorted(edges, time_s)
    error = np.diff(spline_integral(time_s, line[kept, None])[:, 0] - whole[kept])
    assert np.square(np.diff(line[kept], n=2)).sum() / np.square(error).sum() == pytest.approx(JUMPS, rel=0.05)


def test_filtered_rates_of_an_exact_attitude_become_its_own() -> None:
    _, _, rate = fit_of(noise_rad=0.0, filtered_s=0.08)
    _, _, true, mean = course(0.08)
    assert np.sqrt(np.mean(rate**2)) < 0.15 * np.sqrt(np.mean((mean - true) ** 2))


def test_the_noise_of_a_mean_is_the_one_that_means_have() -> None:
    """Means over ten readings, in 20 sessions: the standard deviation that is said against the one that is seen."""
    weight = np.full(10, 0.1)
    said, seen = list[float](), list[float]()
    for seed in range(20):
        fit, gravity, _ = fit_of(noise_rad=4e-4, filtered_s=0.0, seed=seed)
        kept = gravity[: len(gravity) // 10 * 10].reshape(-1, 10, 2).mean(axis=1)
        said.append(fit.of_mean(weight) ** 2)
        seen.append(float(np.mean(kept**2)))
    assert np.sqrt(np.mean(seen)) == pytest.approx(np.sqrt(np.mean(said)), rel=0.35)


def test_readings_with_gaps_and_without_rates_are_fitted_as_well() -> None:
    time_s, tilt, _, _ = course()
    late = time_s + np.where(np.arange(len(time_s)) > 500, 30.0, 0.0)
    fit = fitted(late, gravity_of(tilt), np.zeros((len(tilt), 3)))
    assert fit.delay_s == 0.0
    assert np.abs(fit.gravity - gravity_of(tilt)).max() < 1e-4

"""Rates that are late, and rates that lag, are undone each by its own form."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import lfilter

from shared.geometry import Array
from station.diagnosis.observations.attitude_fit import AttitudeFit, fitted
from station.diagnosis.observations.rate_lag import FORMS, delayed, derivative, lagging

HZ, FINE_S, LATE_S = 100.0, 1e-4, 0.02


def swinging() -> tuple[Array, Array, Array, Array]:
    """Tilts, rates, rates that come LATE_S later, and rates behind a lag of that (n,), of swings at 12 Hz."""
    fine = np.arange(0.0, 20.0, FINE_S)
    burst = np.exp(-8.0 * np.mod(fine, 0.5))
    rate = 0.2 * burst * np.sin(2.0 * math.pi * 12.0 * np.mod(fine, 0.5)) + 0.05 * np.sin(2.0 * math.pi * 0.2 * fine)
    tilt = np.cumsum(rate) * FINE_S
    late = np.interp(fine - LATE_S, fine, rate)
    lags = np.asarray(lfilter([FINE_S / LATE_S], [1.0, FINE_S / LATE_S - 1.0], rate))
    every = round(1.0 / (HZ * FINE_S))
    return tilt[::every], rate[::every], late[::every], lags[::every]


def fit_of(recorded: Array) -> AttitudeFit:
    tilt = swinging()[0] + 1e-5 * np.random.default_rng(4).standard_normal(len(recorded))
    gravity = np.column_stack([np.sin(tilt), 0.0 * tilt, -np.cos(tilt)])
    none = np.zeros_like(recorded)
    return fitted(np.arange(len(tilt)) / HZ, gravity, np.column_stack([none, recorded, none]))


@pytest.mark.parametrize("form", ["late", "lags"])
def test_the_form_is_told_and_undone(form: str) -> None:
    """Each form alone would leave the other's swings wrong by a third."""
    _, rate, late, lags = swinging()
    fit = fit_of(late if form == "late" else lags)
    assert fit.delay_s == pytest.approx(LATE_S, rel=0.02)
    wrong = fit.rate_rad_s[:, 1] - rate
    assert np.sqrt(np.mean(wrong**2)) < 0.08 * np.sqrt(np.mean(rate**2))


def test_no_time_changes_nothing() -> None:
    time_s = np.linspace(0.0, 1.0, 50)
    rate = np.random.default_rng(1).standard_normal((50, 3))
    for form in FORMS:
        undone, by_time = form(time_s, rate, 0.0, [slice(0, 50)])
        assert np.array_equal(undone, rate)
        assert np.array_equal(by_time, rate)


def test_the_integral_grows_with_the_time_by_the_rates_that_are_said() -> None:
    """For each form: the change of the integral by a little more time is that of those rates."""
    time_s = np.linspace(0.0, 2.0, 401)
    rate = np.column_stack([np.sin(3.0 * time_s), np.cos(2.0 * time_s), np.sin(time_s)])
    for form in (delayed, lagging):
        (first, by_time), (more, _) = (form(time_s, rate, by_s, [slice(0, 401)]) for by_s in (0.1, 0.101))
        grown = np.cumsum((more - first) / 0.001, axis=0) * (time_s[1] - time_s[0])
        assert np.abs(grown[60:300] - grown[60] - (by_time[60:300] - by_time[60])).max() < 0.05


def test_parts_have_slopes_of_their_own() -> None:
    time_s = np.concatenate([np.linspace(0.0, 1.0, 30), np.linspace(5.0, 6.0, 30)])
    values = np.concatenate([2.0 * time_s[:30], 7.0 - time_s[30:]])[:, None]
    slopes = derivative(values, time_s, [slice(0, 30), slice(30, 60)])
    assert np.allclose(slopes[:30], 2.0)
    assert np.allclose(slopes[30:], -1.0)

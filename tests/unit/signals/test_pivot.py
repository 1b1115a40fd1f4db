"""The pivot's acceleration from its recorded places: right where it can be seen, none where it would be noise."""

from __future__ import annotations

import numpy as np
import pytest

from shared.geometry import Array
from station.signals.pivot import QUIET_M_S2, pivot_acceleration

SIZE_M, RATE = 0.2e-3, 2 * np.pi * 2.0
TIME_S = np.arange(0.0, 20.0, 0.01)


def places(noise_m: float = 0.0) -> Array:
    """A pivot that swings by 0.2 mm twice a second (0.03 m/s²) in the second half, as it is read."""
    rng = np.random.default_rng(2)
    swing = np.where(TIME_S > 10.0, SIZE_M * np.sin(RATE * TIME_S), 0.0)
    return np.column_stack([0.3 + swing, np.zeros_like(swing), 0.8 - swing]) + rng.normal(0, noise_m, (len(TIME_S), 3))


@pytest.mark.parametrize(("noise_m", "allowed"), [(0.0, 5e-4), (3e-7, 1e-2), (1e-5, QUIET_M_S2)])
def test_a_swing_is_seen_through_the_readings_noise(noise_m: float, allowed: float) -> None:
    found = pivot_acceleration(TIME_S, places(noise_m))
    assert found is not None
    at = np.arange(11.0, 19.0, 0.0037)
    true = -SIZE_M * RATE**2 * np.sin(RATE * at)
    error = found(at)[:, [0, 2]] - np.column_stack([true, -true])
    assert np.sqrt(np.mean(error**2)) < allowed


def test_readings_whose_noise_hides_every_acceleration_say_nothing() -> None:
    assert pivot_acceleration(TIME_S, places(2e-3)) is None


@pytest.mark.parametrize("pivot", [np.zeros((2000, 3)), np.full((2000, 3), np.nan)], ids=["still", "unknown"])
def test_a_pivot_that_is_still_or_unknown_is_none(pivot: Array) -> None:
    assert pivot_acceleration(TIME_S, pivot) is None


def test_a_reading_of_years_later_leaves_the_pivot_unknown() -> None:
    """Evenly spaced places until then asked for a terabyte."""
    time_s = np.append(np.arange(100) * 0.01, 1.6e9)
    assert pivot_acceleration(time_s, np.cumsum(np.ones((101, 3)), axis=0)) is None

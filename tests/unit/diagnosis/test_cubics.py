"""Cubics through values and slopes, and the natural spline: against scipy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from shared.geometry import Array
from station.diagnosis.observations.cubics import Cubics, spline_integral, spline_slopes


def uneven(count: int) -> tuple[Array, Array]:
    rng = np.random.default_rng(count)
    return np.cumsum(rng.uniform(0.5, 1.5, count)), rng.standard_normal((count, 3))


@pytest.mark.parametrize("count", [2, 3, 4, 50])
def test_the_spline_is_the_natural_one(count: int) -> None:
    time_s, values = uneven(count)
    spline = CubicSpline(time_s, values, bc_type="natural")
    slopes = spline_slopes(time_s, values)
    assert np.allclose(slopes, spline(time_s, 1))
    whole = spline.antiderivative()
    assert np.allclose(spline_integral(time_s, values), whole(time_s) - whole(time_s[0]))
    between = np.linspace(time_s[0], time_s[-1], 97)
    cubics = Cubics(time_s, values, slopes.__getitem__)
    assert np.allclose(cubics(between), spline(between))
    assert np.allclose(cubics.slope(between), spline(between, 1))
    assert np.allclose(cubics.bends(), spline(time_s[:-1], 2))


def test_one_value_has_no_slope() -> None:
    assert spline_slopes(np.zeros(1), np.ones((1, 2))).tolist() == [[0.0, 0.0]]
    assert spline_integral(np.zeros(1), np.ones((1, 2))).tolist() == [[0.0, 0.0]]

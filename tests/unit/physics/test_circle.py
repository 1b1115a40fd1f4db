"""Cosine and sine of many angles are those of the mathematics library."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from station.physics.circle import cos_sin


@given(st.lists(st.floats(-1e3, 1e3), min_size=1))
def test_both_are_right_to_rounding(angles: list[float]) -> None:
    cosine, sine = cos_sin(np.array(angles))
    assert np.abs(cosine - np.cos(angles)).max() < 1e-15
    assert np.abs(sine - np.sin(angles)).max() < 1e-15


def test_the_axes_are_met() -> None:
    cosine, sine = cos_sin(np.pi * np.array([0.0, 0.5, 1.0, -1.0, -0.5]))
    assert np.abs(cosine - [1, 0, -1, -1, 0]).max() < 3e-16
    assert np.abs(sine - [0, 1, 0, 0, -1]).max() < 3e-16
    assert (cosine[0], sine[0]) == (1.0, 0.0), "no turn at all is exactly none"


def test_a_nan_stays_one() -> None:
    assert np.isnan(cos_sin(np.array([np.nan]))).all()

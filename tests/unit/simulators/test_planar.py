"""The fast planar simulator against the exact slider."""

from __future__ import annotations

import math

import numpy as np
import pytest

from station.simulators import slider
from station.simulators.planar import planar
from station.simulators.slider import LimitCurve, Tilt

UP_AND_BACK = ((0.0, 2.0, 2.1, 3.0), (0.25, 0.52, 0.52, 0.0))


@pytest.mark.parametrize(
    ("ratio", "axis", "azimuth"), [(1.0, 0.0, 0.0), (1.0, 0.0, 2.2), (0.7, 0.4, 0.0), (1.5, -1.0, 4.0)]
)
def test_onset_and_path_are_those_of_the_exact_slider(ratio: float, axis: float, azimuth: float) -> None:
    curve = LimitCurve(mu_along=0.45 * math.sqrt(ratio), mu_across=0.45 / math.sqrt(ratio), axis_rad=axis)
    tilt = Tilt(time_s=UP_AND_BACK[0], angle_rad=UP_AND_BACK[1], azimuth_rad=azimuth)
    fast = planar.simulate(tilt, curve, start_m=(0.01, -0.02))
    exact = slider.simulate(tilt, curve, start_m=(0.01, -0.02))
    count = min(len(fast.time_s), len(exact.time_s))
    assert count >= 299
    assert np.linalg.norm(exact.place_m[-1] - exact.place_m[0]) > 1e-3
    assert fast.onset_s == pytest.approx(exact.onset_s, abs=1e-9)
    assert fast.onset_rad == pytest.approx(exact.onset_rad, abs=1e-9)
    away = np.linalg.norm(fast.place_m[:count] - exact.place_m[:count], axis=1)
    assert away.max() < 1e-3 * np.linalg.norm(exact.place_m[-1] - exact.place_m[0])


def test_several_slips_in_one_tilt() -> None:
    """Down and back, twice: each slide begins at the friction angle and ends by itself."""
    tilt = Tilt(time_s=(0.0, 1.0, 1.2, 2.2, 2.4), angle_rad=(0.0, 0.45, 0.0, 0.45, 0.0))
    curve = LimitCurve(mu_along=0.45, mu_across=0.45)
    fast, exact = (run(tilt, curve) for run in (planar.simulate, slider.simulate))
    count = min(len(fast.time_s), len(exact.time_s))
    assert np.abs(fast.place_m[:count] - exact.place_m[:count]).max() < 2e-6
    assert not fast.velocity_m_s[-1].any()


def test_a_block_that_holds_never_moves() -> None:
    slide = planar.simulate(Tilt(time_s=(0.0, 3.0), angle_rad=(0.0, 0.3)), LimitCurve(mu_along=0.5, mu_across=0.5))
    assert math.isnan(slide.onset_s)
    assert not slide.place_m.any()

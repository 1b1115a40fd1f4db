"""The exact slider against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from station.simulators import slider
from station.simulators.slider import LimitCurve, Tilt

CIRCLE = LimitCurve(mu_along=0.4, mu_across=0.4)
REPOSE = math.atan(0.4)


def test_a_constant_rate_gives_the_cubic_law() -> None:
    rate = math.radians(1)
    tilt = Tilt(time_s=(0.0, 3.0), angle_rad=(REPOSE - rate, REPOSE + 2 * rate), azimuth_rad=0.7)
    slide = slider.simulate(tilt, CIRCLE)
    assert slide.onset_s == pytest.approx(1.0, abs=1e-9)
    seconds = slide.time_s[130] - 1.0
    law = slider.ramp_displacement(seconds, rate_rad_s=rate, onset_rad=REPOSE)
    assert np.linalg.norm(slide.place_m[130]) == pytest.approx(law, rel=0.01)
    assert slide.place_m[130] / np.linalg.norm(slide.place_m[130]) == pytest.approx(tilt.slope, abs=1e-6)


def test_a_ramp_up_and_down_gives_the_closed_form_of_the_stop() -> None:
    """With the excess k t up for a time T, then falling: a stop at (2 + √2) T after k T³ (1 + 2√2/3) of way."""
    rate, half = math.radians(1), 0.5
    top = REPOSE + rate * half
    tilt = Tilt(time_s=(0.0, half, 5.0), angle_rad=(REPOSE, top, top - rate * (5.0 - half)))
    slide = slider.simulate(tilt, CIRCLE, output_s=0.001)
    distance = slider.GRAVITY * rate / math.cos(REPOSE) * half**3 * (1 + 2 * math.sqrt(2) / 3)
    assert -slide.place_m[-1, 1] == pytest.approx(distance, rel=0.02)
    moving = slide.time_s[slide.velocity_m_s.any(axis=1)]
    assert moving[-1] == pytest.approx((2 + math.sqrt(2)) * half, rel=0.02)


@pytest.mark.parametrize("azimuth", [0.0, 0.5, 1.2, 2.5])
def test_the_onset_on_an_ellipse(azimuth: float) -> None:
    """(g_along / mu_along)² + (g_across / mu_across)² = (g cos θ)² at the onset."""
    curve = LimitCurve(mu_along=0.3, mu_across=0.5, axis_rad=0.4)
    slide = slider.simulate(Tilt(time_s=(0.0, 10.0), angle_rad=(0.0, 0.6), azimuth_rad=azimuth), curve)
    pull = curve.turn @ np.array([math.sin(azimuth), -math.cos(azimuth)]) * math.sin(slide.onset_rad)
    assert np.linalg.norm(pull / curve.mu) == pytest.approx(math.cos(slide.onset_rad), rel=1e-5)


def test_friction_never_adds_energy() -> None:
    curve = LimitCurve(mu_along=0.3, mu_across=0.5, axis_rad=0.4)
    tilt = Tilt(time_s=(0.0, 1.0, 2.0), angle_rad=(0.7, 0.7, 0.0))
    slide = slider.simulate(tilt, curve)
    held = slide.time_s < 1.0
    height = slide.place_m[held] @ tilt.slope * math.sin(0.7)
    energy = 0.5 * (slide.velocity_m_s[held] ** 2).sum(axis=1) - slider.GRAVITY * height
    assert np.all(np.diff(energy) <= 1e-12)


def test_below_the_limit_it_never_slides() -> None:
    slide = slider.simulate(Tilt(time_s=(0.0, 5.0, 9.0), angle_rad=(0.0, REPOSE - 1e-4, 0.0)), CIRCLE)
    assert math.isnan(slide.onset_s)
    assert not slide.place_m.any()


def test_knots_must_ascend() -> None:
    with pytest.raises(ValueError, match="ascend"):
        Tilt(time_s=(0.0, 0.0), angle_rad=(0.0, 1.0))

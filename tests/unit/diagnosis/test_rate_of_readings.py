"""An arm that records no rates, or none that agree with its attitude, has those of its smoothed readings."""

from __future__ import annotations

import math

import numpy as np
import pytest

from shared.geometry import Array
from shared.vectors import cross
from station.diagnosis.observations.cubics import spline_slopes
from station.diagnosis.observations.plate import PlateMotion
from station.diagnosis.observations.rate_of_readings import agree, of_readings
from station.signals.tracks import AttitudeTrack, MotionTrack
from tests.unit.diagnosis import test_rate_noise
from tests.unit.diagnosis.test_rate_noise import HZ, accelerations

STEP_RAD = math.radians(0.088)
"""The step of a servo with 4096 positions a turn."""


COUNT = 1100
"""The readings of fourteen steps of two degrees."""


def ringing_rate() -> Array:
    """The true rates (n, 3), rad/s, the first of them that of the tilt."""
    return test_rate_noise.ringing_rate()[:COUNT]


def tilts() -> Array:
    """The true tilts (n,), rad, about y."""
    return np.cumsum(ringing_rate()[:, 0]) / HZ


def read(*, noise_rad: float = 0.0, step_rad: float = 0.0) -> Array:
    """Returns the tilts (n,), rad, as an arm reads them."""
    tilt = tilts() + noise_rad * np.random.default_rng(11).standard_normal(len(tilts()))
    return np.round(tilt / step_rad) * step_rad if step_rad else tilt


def gravity_at(tilt_rad: Array) -> Array:
    """Gravity's unit vectors (n, 3)."""
    return np.column_stack([np.sin(tilt_rad), 0.0 * tilt_rad, -np.cos(tilt_rad)])


def plate(tilt_rad: Array, rate_rad_s: Array) -> PlateMotion:
    zero, none = np.zeros_like(tilt_rad), np.zeros(0, dtype=np.int64)
    attitude = AttitudeTrack(
        time_ns=np.round(np.arange(len(tilt_rad)) / HZ * 1e9).astype(np.int64),
        quaternion=np.column_stack([np.cos(tilt_rad / 2), zero, np.sin(tilt_rad / 2), zero]),
        rate_rad_s=rate_rad_s,
        pivot_m=np.zeros((len(tilt_rad), 3)),
    )
    motions = MotionTrack(time_ns=none, end_ns=none, run=none, step=none, failed=np.zeros(0, dtype=np.bool_))
    return PlateMotion(attitude, motions)


def error_rad_s2(motion: PlateMotion) -> float:
    """Root mean square of the accelerations' error while the arm is accelerated."""
    time_ns = np.round(np.arange(len(tilts())) / HZ * 1e9).astype(np.int64)
    true = accelerations(ringing_rate())
    found = motion.at(time_ns).acceleration_rad_s2[:, 1]
    return float(np.sqrt(np.square(found - true)[np.abs(true) > 0.3].mean()))


READ = [{"noise_rad": 3e-4}, {"step_rad": STEP_RAD}]


@pytest.mark.parametrize("how", READ, ids=["noise", "steps"])
def test_accelerations_are_those_of_the_smooth_motion(how: dict[str, float]) -> None:
    """Differences of readings, from which rates were made before, err more than twice as much, of an arm that rings."""
    tilt = read(**how)
    found = error_rad_s2(plate(tilt, np.zeros((len(tilt), 3))))
    by_differences = np.gradient(np.gradient(tilt, 1.0 / HZ), 1.0 / HZ)
    true = accelerations(ringing_rate())
    raw = float(np.sqrt(np.square(by_differences - true)[np.abs(true) > 0.3].mean()))
    print(f"\n{how}: {raw:.2f} by differences, {found:.2f} rad/s^2")
    assert found < 0.45 * raw


def test_exact_readings_stay_as_they_are() -> None:
    gravity = gravity_at(tilts())
    found = of_readings(np.arange(len(gravity)) / HZ, gravity)
    np.testing.assert_allclose(found.gravity, gravity, atol=2e-6)


def test_the_noise_of_readings_is_told() -> None:
    found = of_readings(np.arange(len(tilts())) / HZ, gravity_at(read(noise_rad=3e-4)))
    # Half of it is in each of the two components that are counted, of which one does not move.
    assert found.noise_rad == pytest.approx(3e-4 / math.sqrt(2.0), rel=0.1)
    assert found.sigma_rad[0] < 0.6 * found.noise_rad


@pytest.mark.parametrize("noise_rad", [0.0, 1e-3])
@pytest.mark.parametrize(
    ("scale", "right"), [(1.0, True), (0.9, True), (0.0, False), (-1.0, False), (180.0 / math.pi, False)]
)
def test_rates_that_tell_less_of_the_steps_than_none_are_none(scale: float, right: bool, noise_rad: float) -> None:
    """Without a sign, or in degrees for radians."""
    tilt = read(noise_rad=noise_rad)
    rate = np.column_stack([0.0 * tilt, ringing_rate()[:, 0], 0.0 * tilt])
    assert agree(scale * rate, gravity_at(tilt), np.arange(len(tilt)) / HZ) is right


def test_gravity_turns_by_the_rates_that_are_found() -> None:
    time_s = np.arange(len(tilts())) / HZ
    found = of_readings(time_s, gravity_at(tilts()))
    turning = spline_slopes(time_s, found.gravity)
    np.testing.assert_allclose(-cross(found.rate_rad_s, found.gravity), turning, atol=1e-4)


def test_nothing_is_smoothed_across_a_gap() -> None:
    """Two runs, of which the second begins ten seconds later with a plate that is level again."""
    tilt = np.concatenate([tilts(), tilts()])
    time_s = np.concatenate([np.arange(COUNT) / HZ, 10.0 + (COUNT + np.arange(COUNT)) / HZ])
    found, once = of_readings(time_s, gravity_at(tilt)), of_readings(time_s[:COUNT], gravity_at(tilts()))
    np.testing.assert_allclose(found.rate_rad_s[:COUNT], once.rate_rad_s, atol=1e-4)
    np.testing.assert_allclose(found.gravity[COUNT:], gravity_at(tilts()), atol=1e-5)


def test_rates_about_a_gap_are_no_less_right() -> None:
    """The arm is not heard for a minute, just when the plate turns: what it did meanwhile the rates do not tell."""
    turning = int(np.abs(ringing_rate()[:, 0]).argmax())
    time_s = np.arange(COUNT) / HZ + 60.0 * (np.arange(COUNT) > turning)
    rate = np.column_stack([0.0 * time_s, ringing_rate()[:, 0], 0.0 * time_s])
    assert agree(rate, gravity_at(tilts()), time_s)


@pytest.mark.parametrize("count", [3, 8, 60])
def test_few_readings_have_rates_too(count: int) -> None:
    """A short piece of a recording turns evenly, and no rates were recorded."""
    tilt = 0.1 * np.arange(count, dtype=np.float64) / HZ
    motion = plate(tilt, np.zeros((count, 3)))
    middle = np.array([round(count // 2 / HZ * 1e9)])
    assert motion.at(middle).rate_rad_s[0, 1] == pytest.approx(0.1, rel=1e-3)

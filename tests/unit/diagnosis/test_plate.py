"""A plate's motion tells how fast it gathers and loses speed, also between two readings of its attitude."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from shared.geometry import Array
from station.diagnosis.observations.plate import PlateMotion
from station.signals import tracks
from station.signals.tracks import TOGETHER, AttitudeTrack, MotionTrack

HZ, STEPS, STEP_S = 100.0, 40, 0.4037
RATE_RAD_S, ACCELERATION_RAD_S2 = math.radians(5.0), math.radians(200.0)


def _course(time_s: Array) -> tuple[Array, Array, Array]:
    """Tilt, its rate and its acceleration (n,) of a plate that is tilted in steps, each a trapezoid of speed."""
    fine = np.arange(0.0, STEPS * STEP_S, 1e-5)
    phase = np.mod(fine, STEP_S)
    ramp_s = RATE_RAD_S / ACCELERATION_RAD_S2
    rate = np.clip(np.minimum(phase - 0.0537, 0.2371 - phase) / ramp_s, 0.0, 1.0) * RATE_RAD_S
    tilt = np.cumsum(rate) * 1e-5
    speeding = np.gradient(rate, 1e-5)
    return np.interp(time_s, fine, tilt), np.interp(time_s, fine, rate), np.interp(time_s, fine, speeding)


def moving_plate(*, noise_rad: float = 0.0, late_s: float = 0.0, in_bursts: bool = False) -> PlateMotion:
    """Returns a plate's motion from readings at HZ, their rates as late as a filter makes them.

    With `in_bursts` every fortieth is stamped as late as the next one but for 2 µs, and the rates have noise.
    """
    time_s = np.arange(0.0, STEPS * STEP_S, 1.0 / HZ)
    tilt, rate = _course(time_s)[0], _course(np.maximum(time_s - late_s, 0.0))[1]
    tilt = tilt + np.random.default_rng(3).normal(0.0, noise_rad, len(tilt))
    zero = np.zeros_like(tilt)
    stamp_s = time_s.copy()
    if in_bursts:
        stamp_s[5:-1:40] = stamp_s[6::40] - 2e-6
        rate = rate + np.random.default_rng(4).normal(0.0, 5e-3, len(rate))
    attitude = AttitudeTrack(
        time_ns=np.round(stamp_s * 1e9).astype(np.int64),
        quaternion=np.column_stack([np.cos(tilt / 2), zero, np.sin(tilt / 2), zero]),
        rate_rad_s=np.column_stack([zero, rate, zero]),
        pivot_m=np.zeros((len(tilt), 3)),
    )
    none = np.zeros(0, dtype=np.int64)
    motions = MotionTrack(time_ns=none, end_ns=none, run=none, step=none, failed=np.zeros(0, dtype=np.bool_))
    return PlateMotion(attitude, motions)


def _error_rad_s2(motion: PlateMotion) -> float:
    """Root mean square of the acceleration's error while the plate gathers or loses speed."""
    time_s = np.arange(0.5, STEPS * STEP_S - 0.5, 1.3e-3)
    true = _course(time_s)[2]
    read = motion.at(np.round(time_s * 1e9).astype(np.int64)).acceleration_rad_s2[:, 1]
    near = np.abs(true) > 1.0
    return float(np.sqrt(np.mean(np.square(read - true)[near])))


def test_exact_attitudes_show_where_between_two_readings_the_plate_stops() -> None:
    """Rates alone, through a spline, show something between them: an error of a fifth of the acceleration."""
    exact, by_rates = _error_rad_s2(moving_plate()), _error_rad_s2(moving_plate(noise_rad=1e-4))
    assert exact < 0.16 * ACCELERATION_RAD_S2
    assert exact < 0.75 * by_rates < 0.75 * 0.22 * ACCELERATION_RAD_S2


@pytest.mark.parametrize("motion", [{"noise_rad": 1e-4}, {"late_s": 0.02}], ids=["noise", "late rates"])
def test_attitudes_that_do_not_agree_with_their_rates_make_no_wild_accelerations(motion: dict[str, Any]) -> None:
    """A spline overshoots where an acceleration jumps, by up to a fifth."""
    made = moving_plate(**motion)
    time_ns = np.arange(500_000_000, round((STEPS * STEP_S - 0.5) * 1e9), 1_300_000)
    read = made.at(time_ns).acceleration_rad_s2[:, 1]
    assert np.abs(read).max() < 1.25 * ACCELERATION_RAD_S2


@pytest.mark.parametrize("noise_rad", [0.0, 1e-4], ids=["exact", "noise"])
def test_the_least_delay_changes_no_acceleration_at_a_reading(noise_rad: float) -> None:
    """Frames often fall on readings: if all their accelerations jumped there, a clock's offset would seem to matter."""
    motion, time_ns = moving_plate(noise_rad=noise_rad), np.arange(500_000_000, 15_000_000_000, 10_000_000)
    now, late = (motion.at(time_ns, delay_s=delay).acceleration_rad_s2[:, 1] for delay in (0.0, 1e-6))
    assert np.abs(late - now).max() < 2e-3 * ACCELERATION_RAD_S2


def test_a_plate_knows_how_far_it_has_gone_since_it_turned_round() -> None:
    """Up to 0.3 rad, down to 0.05 and up again, at 0.2 rad/s, with rests."""
    told = [(0.0, 0.0), (1.0, 0.0), (2.5, 0.3), (3.0, 0.3), (4.25, 0.05), (5.0, 0.05), (6.0, 0.25)]
    time_s = np.arange(0.0, 6.0, 1.0 / HZ)
    tilt = np.interp(time_s, *np.transpose(told))
    zero = np.zeros_like(tilt)
    attitude = AttitudeTrack(
        time_ns=np.round(time_s * 1e9).astype(np.int64),
        quaternion=np.column_stack([np.cos(tilt / 2), zero, np.sin(tilt / 2), zero]),
        rate_rad_s=np.column_stack([zero, np.gradient(tilt, time_s), zero]),
        pivot_m=np.zeros((len(tilt), 3)),
    )
    none = np.zeros(0, dtype=np.int64)
    motions = MotionTrack(time_ns=none, end_ns=none, run=none, step=none, failed=np.zeros(0, dtype=np.bool_))
    at = PlateMotion(attitude, motions).at(np.array([1_500_000_000, 2_800_000_000, 3_500_000_000, 5_500_000_000]))
    assert at.rising.tolist() == [1.0, 1.0, -1.0, 1.0]
    assert at.gone_rad == pytest.approx([0.1, 0.3, 0.1, 0.1], abs=2e-3)


@pytest.mark.parametrize("readings", [1, 2, 3, 9])
def test_a_mean_over_few_readings_has_a_standard_error(readings: int) -> None:
    """The weights of a slide's window are 0 at its ends: of two readings there, as a slow arm has, none counted."""
    motion = moving_plate(noise_rad=1e-4)
    assert motion.fit is not None
    weight = 1.0 - np.linspace(-1.0, 1.0, 9) ** 2
    sigma_rad = motion.mean_sigma_rad(weight, readings / HZ)
    assert 0.0 < sigma_rad <= motion.fit.noise_rad


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0, 2.0])
def test_readings_that_are_stamped_together_make_no_wild_tilts(share: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Readings 10 ms apart change five thousand times too fast within 2 µs."""
    monkeypatch.setattr(tracks, "TOGETHER", share * TOGETHER)
    time_s = np.arange(0.5, STEPS * STEP_S - 0.5, 1.3e-3)
    seen = moving_plate(noise_rad=1e-4, in_bursts=True).at(np.round(time_s * 1e9).astype(np.int64))
    error_rad = float(np.sqrt(np.square(seen.tilt_rad - _course(time_s)[0]).mean()))
    print(f"\n{share * TOGETHER:g} of the interval: {error_rad:.1e} rad", end="")
    assert (error_rad < 3e-4) == (share > 0.0)

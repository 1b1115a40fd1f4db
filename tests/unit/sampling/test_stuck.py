"""Encoders that are stuck, whole or in a joint, are told from sound ones that are noisy, coarse, smoothed or late."""

from __future__ import annotations

import math

import numpy as np
import pytest

from shared.geometry import Array
from shared.messages import PlatformState
from station.sampling.stuck import Asked, Turning

MS = 1_000_000
RATE_DEG_S = 5.0
DETECT = 300
"""The number of the reading at the detection, 3 s after the first."""


def sound(count: int = DETECT + 1, *, rate_deg_s: float = RATE_DEG_S, holds: bool = True) -> Array:
    """Returns tilts (n,), degrees, every 10 ms: from 10 degrees on in steps of half a second, with holds between."""
    moving = np.arange(count) % 50 < 40 if holds else np.full(count, True)
    return 10.0 + np.concatenate([[0.0], np.cumsum(0.01 * rate_deg_s * moving)[:-1]])


def rates_of(tilt_deg: Array) -> Array:
    """Returns the rates (n,), degrees/s, of a plate that tilts like this."""
    return np.gradient(tilt_deg, 0.01)


def told(
    read_deg: Array,
    rates_deg_s: Array | None = None,
    *,
    rate_deg_s: float = RATE_DEG_S,
    reached_deg: float = 10.0,
    level: bool = False,
    rest_ms: int = 10,
) -> bool:
    """Returns true if readings every 10 ms contradict the plate's motion; without rates they have none."""
    turning = Turning()
    rates = np.zeros(len(read_deg)) if rates_deg_s is None else rates_deg_s
    for number, (tilt, rate) in enumerate(zip(np.radians(read_deg), np.radians(rates), strict=True)):
        state = PlatformState(qw=math.cos(0.5 * tilt), qx=math.sin(0.5 * tilt), wx=float(rate))
        turning.take(state, stamp_ns=number * rest_ms * MS)
    asked = Asked(
        rate_rad_s=math.radians(rate_deg_s),
        return_rad_s=math.radians(20.0),
        reached_rad=math.radians(reached_deg),
        level=level,
    )
    return turning.contradicts(asked, since_ns=0, detect_ns=DETECT * 10 * MS)


def returned(tilt_deg: Array) -> Array:
    """Returns a plate's tilts with its return to level after them, at 20 degrees/s, and a second of rest there."""
    down = np.maximum(tilt_deg[-1] - 0.2 * np.arange(1, 300), 0.0)
    return np.concatenate([tilt_deg, down])


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("rate_deg_s", [0.25, 1.0, 5.0, 14.0])
def test_a_sound_plate_agrees_with_its_motion(rate_deg_s: float, known: bool):
    tilt = sound(rate_deg_s=rate_deg_s)
    rates = rates_of(tilt) if known else None
    assert not told(tilt, rates, rate_deg_s=rate_deg_s)
    whole = returned(tilt)
    assert not told(whole, rates_of(whole) if known else None, rate_deg_s=rate_deg_s, level=True)


def test_a_plate_at_rest_and_one_that_begins_late_are_read_honestly():
    still = np.full(200, 10.0)
    late = np.concatenate([still, sound(DETECT + 1 - 200, holds=False)])
    assert not told(late, rates_of(late))
    assert not told(late)


@pytest.mark.parametrize(("rate_deg_s", "step_deg"), [(5.0, 0.1), (1.0, 0.1), (0.2, 0.01)])
def test_coarse_encoders_are_not_stuck(rate_deg_s: float, step_deg: float):
    tilt = sound(rate_deg_s=rate_deg_s)
    assert not told(step_deg * np.round(tilt / step_deg), rates_of(tilt), rate_deg_s=rate_deg_s)


def test_noisy_readings_with_smoothed_and_noisy_rates_are_not_stuck():
    rng = np.random.default_rng(1)
    for _ in range(50):
        tilt = sound()
        smoothed = np.convolve(rates_of(tilt), np.full(8, 1 / 8))[: len(tilt)]
        smoothed[:8] = RATE_DEG_S
        noisy = tilt + 0.1 * rng.standard_normal(len(tilt))
        assert not told(noisy, smoothed + 0.3 * rng.standard_normal(len(tilt)))


def test_readings_that_stayed_away_are_a_gap_and_no_contradiction():
    """A quarter of a second without readings, half of it in a hold, of whose rates nobody knows."""
    kept = np.concatenate([np.arange(85), np.arange(110, DETECT + 1)])
    turning, tilt, rates = Turning(), np.radians(sound()), np.radians(rates_of(sound()))
    for k in kept:
        state = PlatformState(qw=math.cos(0.5 * tilt[k]), qx=math.sin(0.5 * tilt[k]), wx=float(rates[k]))
        turning.take(state, stamp_ns=int(k) * 10 * MS)
    asked = Asked(rate_rad_s=math.radians(5.0), return_rad_s=math.radians(20.0), reached_rad=0.1, level=False)
    assert not turning.contradicts(asked, since_ns=0, detect_ns=DETECT * 10 * MS)


def stuck(tilt_deg: Array, *, flicker_deg: float = 0.0) -> Array:
    """Returns readings that stay where they were 0.4 s before the detection, with a flicker of the last digits."""
    read = tilt_deg.copy()
    read[DETECT - 40 :] = read[DETECT - 40]
    return read + flicker_deg * np.random.default_rng(2).standard_normal(len(read))


@pytest.mark.parametrize("flicker_deg", [0.0, 1e-7, 0.02])
def test_readings_that_stay_while_the_rates_turn_are_stuck(flicker_deg: float):
    tilt = sound(holds=False)
    assert told(stuck(tilt, flicker_deg=flicker_deg), rates_of(tilt))


def test_two_old_readings_in_turn_are_stuck():
    tilt = sound(holds=False)
    read = tilt.copy()
    read[DETECT - 40 :: 2], read[DETECT - 39 :: 2] = read[DETECT - 40], read[DETECT - 39]
    assert told(read, rates_of(tilt))


@pytest.mark.parametrize("share", [0.6, -0.6])
def test_one_stuck_joint_makes_the_tilt_run_ahead_of_the_rates_or_fall_behind(share: float):
    tilt = sound(holds=False)
    read = tilt.copy()
    read[DETECT - 40 :] += share * (tilt[DETECT - 40 :] - tilt[DETECT - 40])
    assert told(read, rates_of(tilt))


@pytest.mark.parametrize("flicker_deg", [0.0, 1e-7, 0.02])
def test_readings_without_rates_that_are_released_jump(flicker_deg: float):
    tilt = sound(DETECT + 6, holds=False)
    read = stuck(tilt, flicker_deg=flicker_deg)
    assert not told(read)
    read[DETECT + 1 :] = tilt[DETECT + 1 :]
    assert told(read)


def test_readings_without_rates_that_are_never_released_are_not_level_in_the_end():
    whole = returned(sound(holds=False))
    read = stuck(whole)
    assert told(read, level=True)
    assert not told(whole, level=True)


def test_readings_that_never_rose_are_stuck():
    assert told(np.zeros(DETECT + 1), reached_deg=12.0)

"""Paths that gravity and a friction that only brakes can make, and paths that they cannot."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.random import default_rng

from shared.geometry import Array
from station.sampling.no_slide import Seen, is_no_slide
from station.sampling.plan import SlipPlan

HZ = 90.0
M_PER_PX = 0.16e-3
DOWN = np.array([0.0, -1.0])
RATE_RAD_S = math.radians(5.0)


def towards(degrees: float) -> Array:
    """Returns the unit vector (2,) that is so far aside of downhill."""
    turned = math.radians(degrees)
    return np.array([math.sin(turned), -math.cos(turned)])


def seen(
    length_m: Array, *, way: Array, tilt_deg: float, sag_px_per_deg: float = 0.0, noise_px: float = 0.05, hz: float = HZ
) -> Seen:
    """Returns a second of rest and then a path, along a way, on a plate that turns; it ends at the tilt."""
    length = np.concatenate([np.zeros(round(hz)), length_m])
    time_s = np.arange(len(length)) / hz
    tilt = math.radians(tilt_deg) - RATE_RAD_S * (time_s[-1] - time_s)
    noise = M_PER_PX * noise_px * default_rng(3).normal(size=(len(length), 2))
    sag = np.outer(M_PER_PX * sag_px_per_deg * np.degrees(tilt), [0.0, 1.0])
    return Seen(np.round(time_s * 1e9).astype(np.int64), np.outer(length, way) + noise + sag, tilt)


def free(pull_m_s2: float, *, until_m: float = 0.005, hz: float = HZ) -> Array:
    """Returns the way of a block with an acceleration, up to its detection."""
    time_s = np.arange(1, math.ceil(hz * math.sqrt(2.0 * until_m / pull_m_s2)) + 1) / hz
    return 0.5 * pull_m_s2 * time_s**2


def pushed(by_px: float, *, in_s: float) -> Array:
    """Returns the way, m, of what is pushed at one speed."""
    return M_PER_PX * by_px * np.linspace(0.0, 1.0, max(round(in_s * HZ), 1) + 1)[1:]


def told(path: Seen) -> bool:
    return is_no_slide(path, down=DOWN, plan=SlipPlan(), m_per_px=M_PER_PX)


@pytest.mark.parametrize("tilt_deg", [3.0, 10.0, 25.0, 60.0])
@pytest.mark.parametrize("share", [0.05, 0.5, 1.0])
@pytest.mark.parametrize("aside_deg", [0.0, 40.0, -70.0])
def test_a_block_that_friction_brakes_slides(tilt_deg: float, share: float, aside_deg: float) -> None:
    """Friction takes all of the pull but a share, and a grain turns the slide."""
    pull = share * 9.81 * math.sin(math.radians(tilt_deg)) * math.cos(math.radians(aside_deg))
    assert not told(seen(free(pull), way=towards(aside_deg), tilt_deg=tilt_deg))


@pytest.mark.parametrize("hz", [10.0, 30.0, 200.0])
def test_frames_at_any_rate_show_a_slide(hz: float) -> None:
    assert not told(seen(free(1.0, hz=hz), way=DOWN, tilt_deg=20.0, hz=hz))


def test_a_camera_that_sags_moves_the_picture_uphill_before_a_slide() -> None:
    assert not told(seen(free(1.0), way=DOWN, tilt_deg=20.0, sag_px_per_deg=0.5))


@pytest.mark.parametrize("aside_deg", [90.0, 135.0, 180.0])
@pytest.mark.parametrize("in_s", [0.01, 0.06, 0.5])
def test_nothing_slides_up_the_plate_or_across_it(aside_deg: float, in_s: float) -> None:
    """A camera that is knocked, a finger, a second mark to which the tracker jumps."""
    assert told(seen(pushed(25.0, in_s=in_s), way=towards(aside_deg), tilt_deg=6.0))


@pytest.mark.parametrize(("by_px", "in_s"), [(25.0, 0.06), (100.0, 0.01), (40.0, 0.08)])
def test_nothing_slides_faster_than_without_friction(by_px: float, in_s: float) -> None:
    assert told(seen(pushed(by_px, in_s=in_s), way=DOWN, tilt_deg=6.0))


def test_a_jump_in_the_middle_of_a_slide_is_none() -> None:
    slide = free(1.0)
    slide[len(slide) // 2 :] += 40.0 * M_PER_PX
    assert told(seen(slide, way=DOWN, tilt_deg=20.0))


@pytest.mark.parametrize("frames", [1, 2])
def test_one_frame_tells_nothing(frames: int) -> None:
    assert not told(Seen(np.arange(frames) * round(1e9 / HZ), np.zeros((frames, 2)), np.full(frames, 0.1)))

"""Direction, angles, reference and slip rule, each against the paper's words (sections III.C and IV)."""

import math
from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from station.sampling.angles import AngleRange
from station.sampling.direction import candidates, choose, distance_to_border_px, slide_in_image
from station.sampling.plan import DirectionPlan, ReferencePlan, SlipPlan, TiltPlan
from station.sampling.reference import Reference, ReferenceReading
from station.sampling.slip import RestDetector, displacements_px, slipped, threshold_px

SIZE = (600, 600)
SQUARE = (0.0, 0.0, 60.0, 0.0, 60.0, 60.0, 0.0, 60.0)


def moved(*shifts: tuple[float, float]) -> tuple[float, ...]:
    """The square with each corner shifted by its own (x, y)."""
    flat = [value for shift in shifts for value in shift]
    return tuple(a + b for a, b in zip(SQUARE, flat, strict=True))


# --- direction -------------------------------------------------------------------------------------------------------


def test_the_four_directions_slide_down_right_up_and_left_in_the_image():
    slides = [slide_in_image(option.azimuth_rad) for option in candidates(DirectionPlan())]
    np.testing.assert_allclose(slides, [(0, 1), (1, 0), (0, -1), (-1, 0)], atol=1e-12)


@given(x=st.floats(0, 599), y=st.floats(0, 599), azimuth=st.floats(0, 2 * math.pi))
def test_walking_the_distance_ends_on_the_border(x: float, y: float, azimuth: float):
    distance = distance_to_border_px((x, y), azimuth_rad=azimuth, size_px=SIZE)
    dx, dy = slide_in_image(azimuth)
    end = np.array([x + distance * dx, y + distance * dy])
    assert np.min(np.abs(np.concatenate([end, 599 - end]))) < 1e-6
    assert np.all(end > -1e-6)
    assert np.all(end < 599 + 1e-6)


def test_longer_slides_are_favoured_in_proportion_and_shorter_ones_keep_a_chance():
    rng, plan = np.random.default_rng(0), DirectionPlan()
    centre = (450.0, 299.5)  # 149 px to the right, 450 to the left, 299.5 up and down
    counts = Counter(choose(plan, centre_px=centre, size_px=SIZE, rng=rng).number for _ in range(4000))
    weights = np.array([299.5, 149.0, 299.5, 450.0])
    np.testing.assert_allclose([counts[k] / 4000 for k in range(4)], weights / weights.sum(), atol=0.025)


def test_a_direction_without_room_is_left_out_while_there_are_others():
    rng = np.random.default_rng(0)
    chosen = {choose(DirectionPlan(), centre_px=(590.0, 300.0), size_px=SIZE, rng=rng).number for _ in range(300)}
    assert chosen == {0, 2, 3}


@pytest.mark.parametrize("power", [100.0, 1e6, 1e9])
def test_a_high_power_always_takes_the_farthest_way(power: float):
    rng, plan = np.random.default_rng(0), DirectionPlan(distance_power=power)
    chosen = {choose(plan, centre_px=(450.0, 299.5), size_px=SIZE, rng=rng).number for _ in range(100)}
    assert chosen == {3}


def test_a_free_azimuth_covers_the_circle():
    rng, plan = np.random.default_rng(0), DirectionPlan(mode="free")
    chosen = [choose(plan, centre_px=(299.5, 299.5), size_px=SIZE, rng=rng) for _ in range(2000)]
    assert {option.number for option in chosen} == {-1}
    quarter = Counter(option.sector for option in chosen)
    assert min(quarter.values()) > 400


# --- angles ----------------------------------------------------------------------------------------------------------


def test_the_first_25_samples_step_50_times_from_level_to_67_5_degrees():
    angles = AngleRange(TiltPlan())
    for _ in range(24):
        angles.add(2, math.radians(20))
    steps = np.degrees(angles.steps_rad(2, limit_rad=math.pi))
    assert len(steps) == 50
    np.testing.assert_allclose(steps, 1.35 * np.arange(1, 51))


def test_then_the_range_is_mean_plus_minus_three_sd_of_that_direction_alone():
    angles = AngleRange(TiltPlan())
    onsets = np.radians(np.random.default_rng(1).normal(20.0, 1.5, 25))
    for onset in onsets:
        angles.add(1, float(onset))
        angles.add(3, 2 * float(onset))
    low, high = angles.bounds_rad(1, limit_rad=math.pi)
    assert low == pytest.approx(onsets.mean() - 3 * onsets.std(ddof=1))
    assert high == pytest.approx(onsets.mean() + 3 * onsets.std(ddof=1))
    steps = angles.steps_rad(1, limit_rad=math.pi)
    assert (steps[0], steps[-1], len(steps)) == (pytest.approx(low), pytest.approx(high), 51)
    assert angles.bounds_rad(0, limit_rad=math.pi)[0] == 0.0


def test_a_block_that_the_narrowed_range_does_not_move_gets_the_whole_range_until_it_slips():
    """Friction has places: in a session of 20 000 runs a block lay in one for 4600 of them, each of which counted."""
    angles = AngleRange(TiltPlan())
    for onset in np.radians(np.random.default_rng(1).normal(20.0, 1.5, 25)):
        angles.add(1, float(onset))
    narrowed = angles.bounds_rad(1, limit_rad=math.pi)
    angles.add_held()
    assert angles.bounds_rad(1, limit_rad=math.pi) == (0.0, pytest.approx(math.radians(67.5)))
    angles.add(3, math.radians(41))
    assert angles.bounds_rad(1, limit_rad=math.pi) == narrowed


def test_the_arms_own_bound_is_never_passed():
    angles = AngleRange(TiltPlan())
    limit = math.radians(30)
    assert max(angles.steps_rad(0, limit_rad=limit)) == pytest.approx(limit)
    for onset in np.radians(np.linspace(28, 36, 25)):
        angles.add(0, float(onset))
    steps = angles.steps_rad(0, limit_rad=limit)
    assert max(steps) <= limit
    assert min(steps) >= 0


# --- reference -------------------------------------------------------------------------------------------------------


def test_the_reference_is_mean_and_variance_of_several_frames():
    rng = np.random.default_rng(2)
    frames = np.array(SQUARE) + rng.normal(0, 0.2, (10, 8))
    reading = ReferenceReading(ReferencePlan())
    results = [reading.add(tuple(frame.tolist())) for frame in frames]
    assert results[:-1] == [None] * 9
    final = results[-1]
    assert isinstance(final, Reference)
    np.testing.assert_allclose(final.corners_px, frames.mean(axis=0))
    np.testing.assert_allclose(final.variance_px2, frames.var(axis=0, ddof=1))
    assert final.centre_px == pytest.approx(tuple(frames.mean(axis=0).reshape(4, 2).mean(axis=0)))


def test_a_noisy_reference_is_refused_repeated_and_given_up_at_last():
    reading = ReferenceReading(ReferencePlan(frames=4, attempts=2))
    for attempt in (1, 2):
        result = [reading.add(moved(*[(3.0 * (-1) ** k, 0.0)] * 4)) for k in range(4)][-1]
        assert isinstance(result, str)
        assert "expected at most 1 px" in result
        assert reading.refused == attempt
    assert reading.exhausted


def test_a_still_block_is_accepted_after_a_refusal():
    reading = ReferenceReading(ReferencePlan(frames=3))
    refused = [reading.add(moved(*[(5.0 * k, 0.0)] * 4)) for k in range(3)][-1]
    assert isinstance(refused, str)
    assert isinstance([reading.add(SQUARE) for _ in range(3)][-1], Reference)


# --- slip ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("tilt_deg", "limit"), [(0, 10), (20, 30), (45, 55)])
def test_the_threshold_is_ten_plus_the_tilt_in_degrees(tilt_deg: float, limit: float):
    assert threshold_px(SlipPlan(), tilt_rad=math.radians(tilt_deg)) == pytest.approx(limit)


@pytest.mark.parametrize(("count", "expected"), [(2, False), (3, True), (4, True)])
def test_three_of_four_corners_must_be_beyond_it(count: int, expected: bool):
    far, near = (30.1, 0.0), (29.9, 0.0)
    corners = moved(*([far] * count + [near] * (4 - count)))
    verdict = slipped(SlipPlan(), corners_px=corners, reference_px=SQUARE, tilt_rad=math.radians(20))
    assert verdict is expected


def test_displacements_are_euclidean():
    assert displacements_px(moved((3.0, 4.0), (0.0, 0.0), (0.0, -2.0), (6.0, 8.0)), SQUARE) == (5.0, 0.0, 2.0, 10.0)


def test_rest_is_told_only_after_the_block_has_not_moved_for_a_while():
    rest = RestDetector(SlipPlan(rest_px=0.5, rest_s=0.2))
    path = [0.0, 1.0, 2.0, 3.0] + [3.1, 3.2] * 15
    told = [rest.add(moved(*[(x, 0.0)] * 4), capture_ns=k * 11_000_000) for k, x in enumerate(path)]
    first = next(k for k, at in enumerate(told) if at is not None)
    assert told[first] == 3 * 11_000_000
    assert (first - 3) * 11_000_000 >= 200_000_000

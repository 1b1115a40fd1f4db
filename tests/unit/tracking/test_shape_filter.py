"""The shape that earlier places told holds corners together, as long as it is the mark's."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pi_agent.rendering import Pose, Scene, surface
from pi_agent.rendering.projection import corners_px
from pi_agent.tracking.mark import Mark
from pi_agent.tracking.motion import STILL, Way, unsheared
from pi_agent.tracking.shape_filter import Settled, ShapeFilter
from pi_agent.tracking.shutter import Shutter

Points = NDArray[np.complex128]
MARK: Points = 45.0 * np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j], dtype=np.complex128)
PLACED = np.asarray(MARK + (300 + 300j), dtype=np.complex128)
SIGMA_PX, NOISE_PX = 0.04, 0.01
VARIANCE = [(0.5 * SIGMA_PX**2, 2.0 * SIGMA_PX**2)] * 4
LINE_S = 17e-6


def _complex(points: NDArray[np.float64]) -> Points:
    return np.asarray(points[:, 0] + 1j * points[:, 1], dtype=np.complex128)


def _noise(rng: np.random.Generator) -> Points:
    return _complex(rng.normal(0.0, SIGMA_PX, (4, 2)))


def _slid(rng: np.random.Generator, *, places: int, growth: float = 0.0) -> tuple[ShapeFilter, Points]:
    """Returns what so many places tell, 20 px apart, and the next true corners; `growth` is from place to place."""
    shape_filter = ShapeFilter(line_s=0.0)
    for place in range(places):
        corners = _at(place, growth) + _noise(rng)
        shape_filter.settle(corners, VARIANCE, way=STILL, slack_px=0.0)
        shape_filter.learn(corners, sigma_px=SIGMA_PX, noise_px=NOISE_PX, way=STILL)
    return shape_filter, _at(places, growth)


def _at(place: int, growth: float) -> Points:
    return np.asarray(200 + 300j + 20.0 * place + (1.0 + growth * place) * MARK * np.exp(0.05j * place))


def _rms(errors: list[Points]) -> float:
    return float(np.sqrt(np.mean(np.abs(errors) ** 2) / 2.0))


def test_corners_by_edges_and_shape_are_as_much_better_as_is_said() -> None:
    rng = np.random.default_rng(1)
    errors, shares = [], []
    for _ in range(150):
        shape_filter, truth = _slid(rng, places=6)
        told = shape_filter.settle(truth + _noise(rng), VARIANCE, way=STILL, slack_px=0.0)
        assert told is not None
        errors.append(told.corners - truth)
        shares.append(told.mean_share)
    assert _rms(errors) < 0.8 * SIGMA_PX
    assert _rms(errors) == pytest.approx(SIGMA_PX * float(np.mean(shares)), rel=0.12)


def test_at_one_place_nothing_is_known_of_the_shape_however_many_frames_there_are() -> None:
    shape_filter = ShapeFilter(line_s=0.0)
    for _ in range(50):
        shape_filter.learn(PLACED, sigma_px=SIGMA_PX, noise_px=NOISE_PX, way=STILL)
    assert shape_filter.settle(PLACED, VARIANCE, way=STILL, slack_px=0.0) is None


def test_an_edge_that_disagrees_with_the_shape_makes_the_corners_doubtful_and_does_not_move_them() -> None:
    shape_filter, truth = _slid(np.random.default_rng(2), places=8)
    pulled = truth + np.array([0.0, 0.4, 0.4, 0.0]) * np.exp(0.4j)
    told = shape_filter.settle(pulled, VARIANCE, way=STILL, slack_px=0.0)
    assert told is not None
    assert told.worst_share > 2.0
    np.testing.assert_array_equal(told.corners, pulled)


def test_a_mark_that_keeps_disagreeing_has_another_shape() -> None:
    shape_filter, truth = _slid(np.random.default_rng(2), places=8)
    other = truth + np.array([0.0, 0.4, 0.4, 0.0]) * np.exp(0.4j)
    told = []
    for _ in range(15):
        told.append(shape_filter.settle(other, VARIANCE, way=STILL, slack_px=0.0))
        shape_filter.learn(other, sigma_px=SIGMA_PX, noise_px=NOISE_PX, way=STILL)
    assert told[5] is not None
    assert not told[5].agrees
    assert told[-1] is None


def _recalled(shape_filter: ShapeFilter, corners: Points, worse: float) -> Settled | None:
    variance = [(worse**2 * across, worse**2 * turned) for across, turned in VARIANCE]
    return shape_filter.recall(corners, variance, sigma_px=worse * SIGMA_PX, way=STILL, slack_px=0.0)


def test_a_mark_that_is_seen_badly_is_told_by_how_it_was_seen_at_its_place() -> None:
    rng = np.random.default_rng(4)
    errors, told_px = [], []
    for _ in range(150):
        truth = PLACED
        grain = _noise(rng)
        shape_filter = ShapeFilter(line_s=0.0)
        shape_filter.learn(truth + grain, sigma_px=SIGMA_PX, noise_px=NOISE_PX, way=STILL)
        told = _recalled(shape_filter, truth + grain + 1.5 * _noise(rng), 1.8)
        assert told is not None
        if told.agrees:
            errors.append(told.corners - truth)
            told_px.append(told.mean_share * 1.8 * SIGMA_PX)
    assert len(errors) > 130
    assert _rms(errors) < 1.5 * SIGMA_PX
    # The moves of opposite edges apart count for half; plain noise moves the mark as well.
    assert _rms(errors) == pytest.approx(float(np.mean(told_px)), rel=0.25)


def test_a_covered_edge_is_not_explained_by_how_the_mark_was_seen_before() -> None:
    shape_filter = ShapeFilter(line_s=0.0)
    shape_filter.learn(PLACED, sigma_px=SIGMA_PX, noise_px=NOISE_PX, way=STILL)
    told = _recalled(shape_filter, np.asarray(PLACED + 0.5 * np.eye(4)[1], dtype=np.complex128), 1.5)
    assert told is not None
    assert not told.agrees
    assert told.worst_share > 2.0


@pytest.mark.parametrize(("worse", "moved_px"), [(1.0, 0.0), (1.8, 1.5)])
def test_neither_a_mark_seen_as_well_as_before_nor_one_on_another_grain_is_recalled(
    worse: float, moved_px: float
) -> None:
    shape_filter = ShapeFilter(line_s=0.0)
    shape_filter.learn(PLACED, sigma_px=SIGMA_PX, noise_px=NOISE_PX, way=STILL)
    assert _recalled(shape_filter, PLACED + moved_px, worse) is None


def test_what_was_told_far_away_says_nothing_here() -> None:
    shape_filter, truth = _slid(np.random.default_rng(2), places=8)
    assert shape_filter.settle(truth + 120.0, VARIANCE, way=STILL, slack_px=0.0) is None


@pytest.mark.parametrize("growth", [0.004, -0.004])
def test_a_lens_that_changes_the_shape_from_place_to_place_is_found_out(growth: float) -> None:
    rng = np.random.default_rng(3)
    errors, alone = [], []
    for _ in range(60):
        shape_filter, truth = _slid(rng, places=6, growth=growth)
        seen = truth + _noise(rng)
        told = shape_filter.settle(seen, VARIANCE, way=STILL, slack_px=0.0)
        assert told is not None
        errors.append(told.corners - truth)
        alone.append(seen - truth)
    assert _rms(errors) < 1.25 * _rms(alone)


def test_a_rolling_shutter_shears_a_slide_by_what_is_undone() -> None:
    scene = Scene(
        surface("plain", rng=np.random.default_rng(0)), mark=Mark(side_mm=15.0), shutter=Shutter(LINE_S * 1e9)
    )
    for direction in np.arange(0.0, 6.0, 0.7):
        vx, vy = (300.0 * np.array([np.cos(direction), np.sin(direction)])).tolist()
        first, second = (
            _complex(corners_px(scene, Pose(vx * time, vy * time, 0.3 + 2.0 * time, vx, vy, 2.0)))
            for time in (0.0, 1 / 90)
        )
        way = Way(complex(second.mean() - first.mean()) * 90, 2.0)
        seen = np.array(unsheared(second, way=way, line_s=LINE_S))
        still = _complex(corners_px(scene, Pose(yaw_rad=0.3)))
        arms, wanted = seen - seen.mean(), still - still.mean()
        turn = np.vdot(wanted, arms)
        assert np.abs(wanted * turn / abs(turn) - arms).max() < 0.01
        assert np.abs(np.abs(second - second.mean()) - np.abs(wanted)).max() > 0.1

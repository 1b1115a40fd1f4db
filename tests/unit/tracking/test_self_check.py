"""Uneven light on an edge, another's edge and pixels that are no light are seen, which scatter does not show."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pi_agent.rendering import ExactRenderer, FastRenderer, Layer, Pose, Scene, Shadow, surface
from pi_agent.tracking.config import TrackerConfig
from pi_agent.tracking.mark import Mark
from pi_agent.tracking.observation import Observation
from pi_agent.tracking.tracker import Tracker

Floats = NDArray[np.float64]
RECOMMENDED = Mark(side_mm=12.0, margin=0.16, feature="dot")
TAPE = Mark(side_mm=14.0)
WRONG_PX = 0.15


@pytest.fixture(scope="module")
def wood() -> NDArray[np.float32]:
    return surface("wood", rng=np.random.default_rng(11))


def _first_sight(frame: NDArray[np.uint8], mark: Mark) -> Observation:
    return Tracker(TrackerConfig(mark=mark)).track(frame, capture_ns=0)


def _errors_px(seen: Observation, truth: Floats) -> Floats:
    """Distances of the corners (4,), in the order that fits best."""
    turns = [np.linalg.norm(np.roll(seen.corners_px, -turn, axis=0) - truth, axis=1) for turn in range(4)]
    return min(turns, key=lambda distance: float(distance.max()))


def test_a_soft_shadow_along_an_edge_is_in_sigma_or_declared(wood: NDArray[np.float32]) -> None:
    pose, rng = Pose(0.0, 0.0, 0.3), np.random.default_rng(4)
    normalised = []
    for offset_px in np.arange(24.0, 50.0, 2.0):
        across = pose.yaw_rad + 0.02
        middle = 299.5 * (np.cos(across) + np.sin(across))
        shadow = Shadow(across, float(middle + offset_px), light=0.3, soft_px=8.0)
        frame, truth = ExactRenderer(Scene(wood, mark=RECOMMENDED, shadows=(shadow,))).render(pose, rng=rng)
        seen = _first_sight(frame, RECOMMENDED)
        if seen.found:
            errors = _errors_px(seen, truth)
            assert errors.max() <= WRONG_PX
            normalised.append(float(np.mean(errors**2) / 2 / seen.sigma_px**2))
    assert len(normalised) >= 2
    assert float(np.mean(normalised)) < 3.0


def test_an_even_mark_in_even_light_is_not_suspected(wood: NDArray[np.float32]) -> None:
    rng = np.random.default_rng(4)
    renderer = ExactRenderer(Scene(wood, mark=RECOMMENDED))
    sigmas = []
    for yaw_rad in (0.0, 0.002, 0.3, 0.785):
        seen = _first_sight(renderer.render(Pose(1.0, 2.0, yaw_rad), rng=rng)[0], RECOMMENDED)
        assert seen.found, seen.reason
        sigmas.append(seen.sigma_px)
    assert float(np.median(sigmas)) < 0.012


def test_the_edge_of_a_paper_is_not_taken_for_the_marks(wood: NDArray[np.float32]) -> None:
    pose, rng = Pose(0.0, 0.0, 0.2), np.random.default_rng(5)
    _, truth = ExactRenderer(Scene(wood, mark=TAPE)).render(pose, rng=rng)
    for depth_px in (3.0, 5.0, 7.0):
        along, inwards = _directions(truth)
        start = truth[3] - 60.0 * along + depth_px * (1.0 + 60.0 / 70.0) * inwards
        end = truth[2] - 14.0 * along
        paper = np.array([start, end, end - 25.0 * inwards, start - 35.0 * inwards])
        scene = Scene(wood, mark=TAPE, occluders=(Layer((paper,), 0.5),))
        seen = _first_sight(ExactRenderer(scene).render(pose, rng=rng)[0], TAPE)
        assert not seen.found or _errors_px(seen, truth).max() <= WRONG_PX, depth_px


def _directions(truth: Floats) -> tuple[Floats, Floats]:
    """Unit vectors from corner 3 to corner 2, and from that side into the mark."""
    along = (truth[2] - truth[3]) / np.linalg.norm(truth[2] - truth[3])
    inwards = (truth[0] - truth[3]) / np.linalg.norm(truth[0] - truth[3])
    return along, inwards


def test_grain_along_the_edges_of_bare_tape_is_in_sigma(wood: NDArray[np.float32]) -> None:
    rng = np.random.default_rng(6)
    renderer = ExactRenderer(Scene(wood, mark=TAPE))
    normalised = []
    for _ in range(24):
        x_mm, y_mm = rng.uniform(-20, 20, 2).tolist()
        frame, truth = renderer.render(Pose(x_mm, y_mm, float(rng.uniform(-0.05, 0.05))), rng=rng)
        seen = _first_sight(frame, TAPE)
        assert seen.found, seen.reason
        errors = _errors_px(seen, truth)
        assert errors.max() <= WRONG_PX
        normalised.append(float(np.mean(errors**2) / 2 / seen.sigma_px**2))
    assert float(np.mean(normalised)) < 2.0


def test_the_live_picture_of_a_mark_along_the_rows_is_as_exact_as_any(wood: NDArray[np.float32]) -> None:
    rng = np.random.default_rng(7)
    renderer = FastRenderer(Scene(wood, mark=RECOMMENDED), rng=rng)
    errors = []
    for _ in range(16):
        x_mm, y_mm = rng.uniform(-5, 5, 2).tolist()
        frame, truth = renderer.render(Pose(x_mm, y_mm, float(rng.uniform(-0.004, 0.004))))
        seen = _first_sight(frame, RECOMMENDED)
        assert seen.found, seen.reason
        errors.append(_errors_px(seen, truth))
    assert float(np.sqrt(np.mean(np.square(errors)))) < 0.022


def test_a_paper_along_nearly_all_of_an_edge_is_told_by_the_dark_that_goes_on_beyond_it(
    wood: NDArray[np.float32],
) -> None:
    """Its edge is straight, and takes no more of the mark than a mark may be cut askew; seven pixels are left of it."""
    mark = Mark(side_mm=20.0)
    pose, rng = Pose(0.0, 0.0, 0.2), np.random.default_rng(5)
    _, truth = ExactRenderer(Scene(wood, mark=mark)).render(pose, rng=rng)
    along, inwards = _directions(truth)
    start, end = truth[3] - 30.0 * along + 4.0 * inwards, truth[2] - 7.0 * along + 4.0 * inwards
    paper = np.array([start, end, end - 25.0 * inwards, start - 25.0 * inwards])
    frame, _ = ExactRenderer(Scene(wood, mark=mark, occluders=(Layer((paper,), 0.55),))).render(pose, rng=rng)
    seen = _first_sight(frame, mark)
    assert not seen.found
    assert "goes on beyond a corner" in seen.reason

import numpy as np
import pytest

from pi_agent.cameras import CameraInfo, Frame
from pi_agent.live_renderer import LiveRenderer
from pi_agent.observer import Observer
from pi_agent.rendering import ExactRenderer, Pose, Scene, plate_fiducials, surface
from pi_agent.tracking.mark import Mark
from tests.unit.pi_agent.rigs import rig

INFO = CameraInfo(name="test", width_px=600, height_px=600, rate_hz=90.0)
SCENE = Scene(
    plate=surface("steel", rng=np.random.default_rng(2)),
    mark=Mark(margin=0.16),
    mark_height_mm=10.0,
    fiducials=plate_fiducials(),
)
AWAY = Pose(x_mm=400.0)


@pytest.fixture(scope="module")
def renderer() -> LiveRenderer:
    return LiveRenderer(SCENE, rng=np.random.default_rng(3), reach_px=9.0)


@pytest.mark.parametrize("sag_px", [(0.0, 0.0), (3.3, -2.6), (0.5, 0.49), (-8.9, 8.9)])
def test_a_moved_picture_is_the_exact_one_but_for_noise(renderer: LiveRenderer, sag_px: tuple[float, float]):
    pose = Pose(4.0, -3.0, 0.3)
    frames = np.stack([renderer.render(pose, sag_px=sag_px)[0] for _ in range(24)]).astype(float)
    exact = 255 * ExactRenderer(SCENE).light(pose, sag_px=sag_px)
    inner = np.abs(frames.mean(axis=0) - exact)[12:-12, 12:-12]
    # The plate's fine grain is moved by whole pixels; what is measured, marks and fiducials, by the fraction as well.
    assert np.quantile(inner, 0.99) < (3.0 if sag_px == (0.0, 0.0) else 14.0)
    corners = renderer.render(pose, sag_px=sag_px)[1]
    left, top = np.floor(corners.min(axis=0)).astype(int) - 4
    right, bottom = np.ceil(corners.max(axis=0)).astype(int) + 4
    assert np.sqrt(np.mean(inner[top - 12 : bottom - 12, left - 12 : right - 12] ** 2)) < 4.0


@pytest.mark.parametrize("sag_px", [(2.4, -1.3), (2.6, -1.3), (2.6, -1.6)])
def test_block_and_fiducials_move_with_the_picture_to_a_hundredth(renderer: LiveRenderer, sag_px: tuple[float, float]):
    places: list[np.ndarray] = []
    for shift in ((0.0, 0.0), sag_px):
        observer = Observer(rig(plate_rate_hz=90.0), INFO)
        seen: dict[int, list[np.ndarray]] = {}
        for number in range(25):
            image, _ = renderer.render(Pose(4.0, -3.0, 0.3), sag_px=shift)
            frame = Frame(image, number * 11_111_112, number)
            for report in (observer.block(frame), *observer.plate(frame)):
                if report.found:
                    seen.setdefault(report.marker_id, []).append(np.reshape(report.corners_px, (4, 2)).mean(axis=0))
        assert sorted(seen) == [0, 1, 2, 3, 4]
        places.append(np.stack([np.mean(seen[marker], axis=0) for marker in range(5)]))
    np.testing.assert_allclose(places[1] - places[0], np.tile(sag_px, (5, 1)), atol=0.02)


def test_frames_differ_in_noise_only(renderer: LiveRenderer):
    first, second = (renderer.render(None)[0].astype(int) for _ in range(2))
    assert 0.5 < (first - second).std() / np.sqrt(2) < 5.0
    assert abs(first.mean() - second.mean()) < 0.1


def test_a_block_out_of_the_picture_is_no_trouble(renderer: LiveRenderer):
    image, corners = renderer.render(AWAY)
    assert image.shape == (600, 600)
    assert corners[:, 0].min() > 600


def test_a_block_beside_a_fiducial_does_not_wipe_it_out(renderer: LiveRenderer):
    pose = Pose(-36.0, -34.0, 0.0)  # its white rim and the fiducial's overlap in their patches
    frames = np.stack([renderer.render(pose)[0] for _ in range(8)]).astype(float)
    exact = 255 * ExactRenderer(SCENE).light(pose)
    assert np.abs(frames.mean(axis=0) - exact)[20:140, 20:140].mean() < 2.0

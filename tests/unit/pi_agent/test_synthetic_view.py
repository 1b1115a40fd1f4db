import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pi_agent.calibration.model import geometry_message, nominal
from pi_agent.synthetic_view import SyntheticOptions, SyntheticView, seen_pose
from shared.errors import UserError
from shared.geometry import block_pose_of, mark_corners, pixels_of_mark
from shared.messages import TwinScene
from shared.rig import MarkConfig
from tests.unit.pi_agent.rigs import SIDE_M, rig, scene

RIG = rig()
GEOMETRY = geometry_message(nominal(RIG, width_px=600, height_px=600), RIG, stamp_ns=0)


@pytest.fixture(scope="module")
def view() -> SyntheticView:
    return SyntheticView(RIG, rng=np.random.default_rng(1))


def projected(x_m: float, y_m: float, yaw_rad: float) -> np.ndarray:
    """The mark's corners (4, 2) in pixels by shared.geometry alone."""
    cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
    corners = mark_corners(side_m=1e-3 * RIG.mark.side_mm) @ np.array([[cos, sin], [-sin, cos]]) + (x_m, y_m)
    return pixels_of_mark(corners, GEOMETRY)


@settings(max_examples=20, deadline=None)
@given(
    x=st.floats(-0.03, 0.03),
    y=st.floats(-0.03, 0.03),
    yaw=st.floats(-math.pi, math.pi),
)
def test_the_renderer_and_the_geometry_agree_on_every_corner(view: SyntheticView, x: float, y: float, yaw: float):
    _, corners = view.frame_and_corners(scene(x, y, yaw), 0)
    np.testing.assert_allclose(corners, projected(x, y, yaw), atol=1e-6)
    found = block_pose_of(np.ravel(corners).tolist(), GEOMETRY)
    assert found[:2] == pytest.approx((x, y), abs=1e-9)
    assert math.remainder(found[2] - yaw, 2 * math.pi) == pytest.approx(0, abs=1e-9)


def test_the_mark_is_dark_where_the_geometry_says(view: SyntheticView):
    image = view.frame(scene(0.02, 0.01), 0)
    (left, top), (right, bottom) = projected(0.02, 0.01, 0.0)[0], projected(0.02, 0.01, 0.0)[2]
    inside = image[int(top) + 3 : int(bottom) - 3, int(left) + 3 : int(right) - 3]
    assert bottom > top
    assert right > left
    assert inside.max() < 60 < np.median(image)


def test_a_moving_block_is_drawn_at_the_capture_time(view: SyntheticView):
    before, after = scene(0.0, 0.0, stamp_ns=0), scene(0.001, 0.002, 0.01, stamp_ns=5_000_000)
    _, corners = view.frame_and_corners(after, 2_500_000, before=[before])
    np.testing.assert_allclose(corners, projected(0.0005, 0.001, 0.005), atol=1e-6)


def test_a_rolling_shutter_shows_each_corner_at_its_own_time():
    options = SyntheticOptions(rolling_shutter=True, row_time_us=18.0)
    view = SyntheticView(RIG, rng=np.random.default_rng(1), options=options)
    speed = 0.2
    before, after = scene(0.0, stamp_ns=0), scene(speed * 0.005, stamp_ns=5_000_000)
    _, corners = view.frame_and_corners(after, 5_000_000, before=[before])
    times = view.info.row_times.dt_s(corners[:, 1])
    still = np.stack([projected(speed * (0.005 + t), 0.0, 0.0)[i] for i, t in enumerate(times)])
    np.testing.assert_allclose(corners, still, atol=1e-4)
    assert np.ptp(times) > 1e-3
    assert view.info.row_times.dt_s(299.5) == pytest.approx(0.0)


def test_a_block_that_speeds_up_is_drawn_with_the_speed_of_its_moment():
    view = SyntheticView(RIG, rng=np.random.default_rng(1), options=SyntheticOptions(rolling_shutter=True))
    gain, times_ns = 4.0, (0, 5_000_000, 12_000_000)
    before = [scene(0.5 * gain * (t * 1e-9) ** 2, stamp_ns=t) for t in times_ns]
    _, corners = view.frame_and_corners(before[2], 13_000_000, before=before[:2])
    times = 0.013 + view.info.row_times.dt_s(corners[:, 1])
    moved = np.stack([projected(0.5 * gain * t**2, 0.0, 0.0)[i] for i, t in enumerate(times)])
    np.testing.assert_allclose(corners, moved, atol=1e-4)


def test_a_block_that_is_stopped_is_not_drawn_as_if_it_turned_back():
    options = SyntheticOptions(rolling_shutter=True)
    view = SyntheticView(RIG, rng=np.random.default_rng(1), options=options)
    before = [scene(x, stamp_ns=t) for x, t in ((0.0, 0), (0.003, 10_000_000), (0.0035, 20_000_000))]
    pose = seen_pose(before[2], 20_000_000, before=before[:2], block_height_m=SIDE_M)
    assert pose is not None
    assert pose.vx_mm_s == pytest.approx(0.0, abs=1e-9)
    _, corners = view.frame_and_corners(before[2], 40_000_000, before=before[:2])
    np.testing.assert_allclose(corners, projected(0.0035, 0.0, 0.0), atol=1e-3)


def test_the_same_seed_gives_the_same_pixels():
    first, second = (
        [SyntheticView(RIG, rng=np.random.default_rng(4)).frame(scene(0.001 * k), 0) for k in range(2)]
        for _ in range(2)
    )
    assert all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))


def test_a_block_that_is_away_or_on_its_side_shows_no_mark():
    away = TwinScene(block_z_m=-1.0)
    over = TwinScene(block_z_m=0.005, block_qw=math.cos(math.pi / 4), block_qx=math.sin(math.pi / 4))
    assert seen_pose(away, 0, block_height_m=SIDE_M) is None
    assert seen_pose(over, 0, block_height_m=SIDE_M) is None


def test_a_leaning_block_rises_on_the_right_side():
    lean = 0.2  # about the plate's x: the mark's far side (plate +y, up in the image) rises towards the camera
    tilted = TwinScene(block_z_m=0.005, block_qw=math.cos(lean / 2), block_qx=math.sin(lean / 2))
    _, corners = SyntheticView(RIG, rng=np.random.default_rng(1)).frame_and_corners(tilted, 0)
    top, bottom = corners[1, 0] - corners[0, 0], corners[2, 0] - corners[3, 0]
    assert top > bottom + 0.1
    flat = projected(0.0, 0.0, 0.0)
    height = (corners[3, 1] - corners[0, 1]) / (flat[3, 1] - flat[0, 1])
    assert height == pytest.approx(math.cos(lean), abs=2e-3)


def test_a_sagging_camera_moves_the_picture_uphill():
    view = SyntheticView(RIG, rng=np.random.default_rng(1), options=SyntheticOptions(sag_px=2.0))
    tilt = math.radians(30)
    # Turned about the plate's x so that +y (up in the image) goes down.
    down_y = TwinScene(block_z_m=0.005, qw=math.cos(tilt / 2), qx=-math.sin(tilt / 2))
    _, corners = view.frame_and_corners(down_y, 0)
    np.testing.assert_allclose(corners - projected(0, 0, 0), np.tile([0.0, 1.0], (4, 1)), atol=1e-9)


def test_another_frame_size_is_refused():
    with pytest.raises(UserError, match="600"):
        SyntheticView(rig(width_px=640), rng=np.random.default_rng(1))


def test_a_marked_mark_is_drawn_with_its_feature():
    dotted = SyntheticView(rig(mark=MarkConfig(feature="dot")), rng=np.random.default_rng(1)).frame(scene(), 0)
    plain = SyntheticView(rig(mark=MarkConfig()), rng=np.random.default_rng(1)).frame(scene(), 0)
    assert dotted[275:300, 275:300].max() > 150 > plain[275:300, 275:300].max()

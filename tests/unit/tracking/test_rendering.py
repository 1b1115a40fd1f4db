"""The renderer's truth: areas are exact, corners are where the formulas put them, the fast one agrees."""

import numpy as np
import pytest

from pi_agent.rendering import ExactRenderer, FastRenderer, Layer, Optics, Pose, Scene, Sensor, plate_fiducials, surface
from pi_agent.rendering.coverage import polygon_coverage
from pi_agent.rendering.projection import collect_edges, corners_px
from pi_agent.tracking.mark import Mark
from pi_agent.tracking.shutter import Shutter
from pi_agent.tracking.tone import LINEAR, PI_DEFAULT

ROLLING = Shutter(line_ns=17_000.0, exposure_ns=2_000_000)


def _cover(polygon: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    edges = collect_edges((Layer((polygon,), 1.0),))
    return polygon_coverage(edges.starts[None], edges.ends[None], edges.layer, layers=1, shape=shape)[0]


def test_coverage_of_a_box_is_the_product_of_its_overlaps() -> None:
    box = np.array([[1.25, 2.5], [4.0, 2.5], [4.0, 5.125], [1.25, 5.125]])
    columns, rows = np.array([0, 0.75, 1, 1, 0, 0]), np.array([0, 0, 0.5, 1, 1, 0.125])
    np.testing.assert_allclose(_cover(box, (6, 6)), np.outer(rows, columns), atol=1e-6)


def test_coverage_sums_to_the_area_at_any_turn() -> None:
    rng = np.random.default_rng(3)
    for angle in rng.uniform(0, 2 * np.pi, 20):
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        square = 7.3 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) @ turn + rng.uniform(14, 16, 2)
        cover = _cover(square, (32, 32))
        assert cover.sum() == pytest.approx(14.6**2, rel=1e-4)
        centre = (cover.sum(axis=0) @ (np.arange(32) + 0.5), cover.sum(axis=1) @ (np.arange(32) + 0.5)) / cover.sum()
        # a partly covered pixel's light counts at the pixel's centre: a few thousandths are lost to that
        np.testing.assert_allclose(centre, square.mean(axis=0), atol=5e-3)


def test_a_centred_square_has_its_corners_where_arithmetic_puts_them() -> None:
    scene = Scene(surface("plain", rng=np.random.default_rng(1)), mark=Mark(side_mm=12))
    expected = 299.5 + 36.0 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    np.testing.assert_allclose(corners_px(scene, Pose()), expected, atol=1e-9)
    quarter = corners_px(scene, Pose(yaw_rad=np.pi / 2))
    np.testing.assert_allclose(quarter, np.roll(expected, -1, axis=0), atol=1e-9)


def test_a_raised_mark_is_larger() -> None:
    scene = Scene(surface("plain", rng=np.random.default_rng(1)), mark=Mark(side_mm=10), mark_height_mm=30.0)
    sides = np.linalg.norm(np.diff(corners_px(scene, Pose()), axis=0), axis=1)
    np.testing.assert_allclose(sides, 60.0 / 0.9, atol=1e-9)


def test_a_rolling_shutter_sees_each_corner_at_its_rows_time() -> None:
    scene = Scene(surface("plain", rng=np.random.default_rng(1)), mark=Mark(side_mm=12), shutter=ROLLING)
    seen = corners_px(scene, Pose(vx_mm_s=300.0))
    still = corners_px(scene, Pose())
    np.testing.assert_allclose(seen[:, 0] - still[:, 0], 1800.0 * ROLLING.dt_s(seen[:, 1]), atol=1e-6)


def test_a_block_that_begins_to_slide_while_it_is_read_lies_in_the_first_rows_and_speeds_up_in_the_last() -> None:
    scene = Scene(surface("plain", rng=np.random.default_rng(1)), mark=Mark(side_mm=12), shutter=ROLLING)
    began_s, gain = float(ROLLING.dt_s(299.5)), 5000.0
    x, vx = 0.5 * gain * began_s**2, -gain * began_s
    seen = corners_px(scene, Pose(x, vx_mm_s=vx, gain=(gain, 0.0, 0.0), moves_s=(began_s, np.inf)))
    still = corners_px(scene, Pose())
    np.testing.assert_allclose(seen[:2], still[:2], atol=1e-9)
    since_s = ROLLING.dt_s(seen[2:, 1]) - began_s
    np.testing.assert_allclose(seen[2:, 0] - still[2:, 0], 3.0 * gain * since_s**2, rtol=1e-6)


@pytest.mark.parametrize("pose", [Pose(4.0, -7.0, 0.4), Pose(4.0, -7.0, 0.4, vx_mm_s=200.0, yaw_rate_rad_s=2.0)])
def test_the_fast_renderer_paints_the_same_light(pose: Pose) -> None:
    quiet = Sensor(full_scale_e=1e9, read_noise_e=0.0)
    scene = Scene(
        surface("wood", rng=np.random.default_rng(1)),
        mark=Mark(margin=0.16, feature="dot"),
        sensor=quiet,
        shutter=ROLLING,
    )
    rng = np.random.default_rng(2)
    exact, corners = ExactRenderer(scene).render(pose, rng=rng)
    fast, same = FastRenderer(scene, rng=rng).render(pose)
    np.testing.assert_array_equal(corners, same)
    difference = np.abs(exact.astype(float) - fast)
    assert difference.mean() < 0.1
    assert np.sqrt(np.mean(difference[220:300, 290:370] ** 2)) < 2.5


def test_the_fast_renderer_moves_the_fiducials_with_the_sag() -> None:
    scene = Scene(surface("wood", rng=np.random.default_rng(1)), fiducials=plate_fiducials())
    renderer = FastRenderer(scene, rng=np.random.default_rng(2))
    before, _ = renderer.render(None)
    after, _ = renderer.render(None, sag_px=(0.4, 0.0))
    patch = (slice(30, 65), slice(30, 65))
    weights = [255.0 - frame[patch].astype(float) for frame in (before, after)]
    x = np.arange(35.0)
    dark = [np.clip(w - 120.0, 0, None) for w in weights]
    centres = [float((d.sum(axis=0) @ x) / d.sum()) for d in dark]
    assert centres[1] - centres[0] == pytest.approx(0.4, abs=0.08)


def test_equal_seeds_give_equal_frames() -> None:
    scene = Scene(
        surface("steel", rng=np.random.default_rng(5)), optics=Optics(radial=0.01), sensor=Sensor(tone=PI_DEFAULT)
    )
    first, _ = ExactRenderer(scene).render(Pose(1.0, 2.0, 0.1), rng=np.random.default_rng(9))
    second, _ = ExactRenderer(scene).render(Pose(1.0, 2.0, 0.1), rng=np.random.default_rng(9))
    np.testing.assert_array_equal(first, second)


def test_tone_curves_are_undone_by_their_tables() -> None:
    light = np.linspace(0.02, 1.0, 50, dtype=np.float32)
    for curve in (LINEAR, PI_DEFAULT):
        values = np.rint(curve.to_value(light)).astype(int)
        np.testing.assert_allclose(curve.to_light_table()[values] / 255.0, light, atol=0.008)


def test_scenes_are_compared_by_all_but_their_plates() -> None:
    """A plate is an array: compared among the other fields it raises, always from Python 3.13 on."""
    rng = np.random.default_rng(1)
    one, other = (Scene(surface("steel", rng=rng), mark=Mark(side_mm=12)) for _ in range(2))
    assert one == other
    assert one != Scene(one.plate, mark=Mark(side_mm=13))

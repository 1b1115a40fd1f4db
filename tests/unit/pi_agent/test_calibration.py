"""The calibration against pictures whose truth is known."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pi_agent.calibration import session
from pi_agent.calibration.lens import BoardSpec, calibrate_lens, undistorted
from pi_agent.calibration.model import Calibration, calibration_message, geometry_message, nominal
from pi_agent.calibration.picture import draw
from pi_agent.calibration.plate import calibrate_plate, find_fiducials, known_corners_m
from pi_agent.calibration.scatter import advice, exposure_row, measure_scatter
from pi_agent.calibration.store import load_calibration, write_calibration
from pi_agent.calibration.tone import Exposed, fit_noise, fit_tone
from pi_agent.cameras import CameraInfo, Frame, Image
from pi_agent.observer import Observer
from pi_agent.rendering import ExactRenderer, Fiducial, Optics, Pose, Scene, surface
from pi_agent.rendering.projection import project
from pi_agent.synthetic_view import SyntheticOptions, SyntheticView
from pi_agent.tracking.mark import Mark
from pi_agent.tracking.tone import LINEAR, PI_DEFAULT
from shared.clock import SystemClock
from shared.errors import UserError
from shared.frames import camera_pose
from shared.geometry import apply_homography, block_pose_of
from shared.rig import RigConfig
from tests.unit.pi_agent.rigs import rig, scene

Floats = NDArray[np.float64]
INFO = CameraInfo(name="test", width_px=600, height_px=600, rate_hz=90.0, exposure_ns=2_000_000)
BOARD = BoardSpec(9, 7, 6.0)


# --- lens ------------------------------------------------------------------------------------------------------------

FOCAL, CENTRE, RADIAL = 1500.0, (310.0, 290.0), -0.35
TRUE_K = np.array([[FOCAL, 0, CENTRE[0]], [0, FOCAL, CENTRE[1]], [0, 0, 1.0]])
TRUE_D = (RADIAL, 0.0, 0.0, 0.0, 0.0)
PX_PER_M = 20e3


@functools.cache
def flat_board() -> Image:
    """The printed board, softened by the lens."""
    sharp = BOARD.picture(px_per_square=round(1e-3 * BOARD.square_mm * PX_PER_M))
    return np.asarray(cv2.GaussianBlur(sharp, (0, 0), 3.0), dtype=np.uint8)


@functools.cache
def true_rays() -> Floats:
    """The direction (600², 3) in which every pixel looks."""
    side = np.arange(600.0)
    pixels = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    return np.column_stack([(undistorted(pixels, TRUE_K, TRUE_D) - CENTRE) / FOCAL, np.ones(len(pixels))])


def board_view(turn: Floats, shift_m: Floats) -> Image:
    """The board seen through the true lens: every pixel's ray is followed to the board."""
    rotation = cv2.Rodrigues(turn)[0]
    normal, rays = rotation[:, 2], true_rays()
    points = rays * ((normal @ shift_m) / (rays @ normal))[:, None]
    rim = round(1e-3 * BOARD.square_mm * PX_PER_M) // 2
    on_board = (points - shift_m) @ rotation[:, :2] * PX_PER_M + rim - 0.5
    x, y = (on_board[:, i].reshape(600, -1).astype(np.float32) for i in (0, 1))
    seen = cv2.remap(flat_board(), x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=120)
    noise = np.random.default_rng(int(1e6 * abs(shift_m[0]) + 1e3 * abs(turn[0]))).normal(0, 1.5, seen.shape)
    return np.clip(seen + noise, 0, 255).astype(np.uint8)


def board_views(*, tilt_rad: float = 0.45, count: int = 10) -> list[Image]:
    views: list[Image] = []
    middle = 0.5e-3 * BOARD.square_mm * np.array([BOARD.columns, BOARD.rows, 0.0])
    for number in range(count):
        angle = 2 * math.pi * number / 10
        turn = tilt_rad * np.array([math.cos(angle), math.sin(angle), 0.2 * math.sin(3 * angle)])
        place = np.array([0.022 * math.cos(2.6 * angle), 0.025 * math.sin(2.6 * angle), 0.16 + 0.004 * number])
        views.append(board_view(turn, place - cv2.Rodrigues(turn)[0] @ middle))
    return views


@pytest.fixture(scope="module")
def views() -> list[Image]:
    return board_views()


def test_the_lens_is_recovered(views: list[Image]):
    lens = calibrate_lens(views, BOARD)
    assert lens.rms_px < 0.15
    assert lens.intrinsics[0, 0] == pytest.approx(FOCAL, rel=3e-3)
    assert lens.intrinsics[1, 1] == pytest.approx(FOCAL, rel=3e-3)
    # The rays matter: an ideal pixel against the true one, all over the picture.
    pixels = np.stack(np.meshgrid(np.linspace(30, 570, 7), np.linspace(30, 570, 7)), axis=-1).reshape(-1, 2)
    true_rays = (undistorted(pixels, TRUE_K, TRUE_D) - CENTRE) / FOCAL
    found = (lens.undistorted(pixels) - lens.intrinsics[:2, 2]) / np.diag(lens.intrinsics)[:2]
    difference = (found - true_rays) * FOCAL
    assert np.sqrt(np.mean((difference - difference.mean(axis=0)) ** 2)) < 0.5
    assert lens.focal_sigma_px < 0.01 * FOCAL


def test_too_few_views_are_refused(views: list[Image]):
    with pytest.raises(UserError, match="got it in 3 of 5"):
        calibrate_lens([*views[:3], np.full((600, 600), 90, np.uint8), np.zeros((600, 600), np.uint8)], BOARD)


def test_a_few_good_views_are_not_blamed_on_the_board(views: list[Image]):
    with pytest.raises(UserError, match="4 of 4: take more"):
        calibrate_lens(views[:4], BOARD)


def test_views_without_tilt_are_refused(views: list[Image]):
    with pytest.raises(UserError, match="focal length cannot be told"):
        calibrate_lens(board_views(tilt_rad=0.02, count=8), BOARD)


def test_a_wrong_board_is_refused(views: list[Image]):
    with pytest.raises(UserError, match="was printed"):
        calibrate_lens(views, BoardSpec(5, 5, 6.0, "7X7_50"))


@pytest.mark.parametrize("text", ["9x7", "9x7x", "2x7x6", "9x7x-1", "chess"])
def test_a_board_is_three_numbers(text: str):
    with pytest.raises(UserError, match="like 9x7x6"):
        BoardSpec.parse(text)
    assert BoardSpec.parse("9x7x6.5") == BoardSpec(9, 7, 6.5)


# --- plate -----------------------------------------------------------------------------------------------------------


def tilted_scene(config: RigConfig, *, shift_mm: float = 0.0, **optics: object) -> Scene:
    place = config.plate.fiducial_place_mm
    mark = Mark(side_mm=config.plate.fiducial_side_mm, margin=0.25)
    spots = [Fiducial(x * place, y * place, mark=mark) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    spots[0] = dataclasses.replace(spots[0], x_mm=spots[0].x_mm + shift_mm)
    return Scene(
        plate=surface("steel", rng=np.random.default_rng(5)),
        mark=Mark(margin=0.16),
        mark_height_mm=10.0,
        fiducials=tuple(spots),
        optics=Optics(**optics),  # pyright: ignore[reportArgumentType]  # the tests' own keywords
    )


def frames_of(seen: Scene, count: int, *, pose: Pose | None = None) -> Image:
    renderer, rng = ExactRenderer(seen), np.random.default_rng(6)
    return np.stack([renderer.render(pose or Pose(2.0, 3.0, 0.1), rng=rng)[0] for _ in range(count)])


@pytest.fixture(scope="module")
def tilted() -> tuple[Scene, Image]:
    seen = tilted_scene(rig(), px_per_mm=5.6, tilt_rad=(0.012, -0.016), radial=-0.012)
    return seen, frames_of(seen, 12)


def true_lens(seen: Scene) -> tuple[Floats, tuple[float, ...]]:
    """The renderer's lens as OpenCV's: r → r (1 + radial (r / 300 px)²), about the picture's middle."""
    focal = seen.optics.px_per_mm * seen.optics.height_mm
    matrix = np.array([[focal, 0, 299.5], [0, focal, 299.5], [0, 0, 1.0]])
    return matrix, (seen.optics.radial * (focal / 300.0) ** 2, 0.0, 0.0, 0.0, 0.0)


def test_a_tilted_camera_with_distortion_is_mapped_to_the_plate(tilted: tuple[Scene, Image]):
    seen, frames = tilted
    config = rig()
    matrix, distortion = true_lens(seen)
    corners = find_fiducials(frames, config, INFO, tone=LINEAR)
    view = calibrate_plate(corners, config, intrinsics=matrix, distortion=distortion)
    places_mm = np.stack(np.meshgrid(np.linspace(-40, 40, 5), np.linspace(-40, 40, 5)), axis=-1).reshape(-1, 2)
    pixels = project(places_mm, Pose(), optics=seen.optics, height_mm=0.0)[0]
    mapped = 1e3 * apply_homography(view.plate_from_pixel, undistorted(pixels, matrix, distortion))
    np.testing.assert_allclose(mapped, places_mm * (1, -1), atol=0.02)
    assert view.rms_px < 0.05
    assert view.camera_m[2] == pytest.approx(0.3, rel=5e-3)
    assert view.tilt_rad == pytest.approx(math.hypot(0.012, 0.016), abs=3e-3)


def test_the_block_is_placed_by_a_calibration_and_misplaced_without(tilted: tuple[Scene, Image]):
    seen, frames = tilted
    config = rig()
    matrix, distortion = true_lens(seen)
    corners = find_fiducials(frames, config, INFO, tone=LINEAR)
    view = calibrate_plate(corners, config, intrinsics=matrix, distortion=distortion)
    known = dataclasses.replace(
        nominal(config, width_px=600, height_px=600),
        focal_px=(matrix[0, 0], matrix[1, 1]),
        distortion=distortion,
        plate_from_pixel=tuple(view.plate_from_pixel.ravel().tolist()),
        camera_m=view.camera_m,
    )
    report = Observer(config, INFO, calibration=known).block(Frame(frames[0], 0, 0))
    ideal = undistorted(np.reshape(report.corners_px, (4, 2)), matrix, distortion)
    x, y, yaw = block_pose_of(ideal.ravel().tolist(), geometry_message(known, config, stamp_ns=0))
    assert (1e3 * x, 1e3 * y) == pytest.approx((2.0, -3.0), abs=0.03)
    assert yaw == pytest.approx(-0.1, abs=2e-3)
    rough = geometry_message(nominal(config, width_px=600, height_px=600), config, stamp_ns=0)
    assert abs(1e3 * block_pose_of(report.corners_px, rough)[0] - 2.0) > 0.5


def test_without_a_lens_the_scale_is_measured_and_the_height_believed():
    config = rig()
    frames = frames_of(tilted_scene(config, px_per_mm=6.3), 6)
    view = calibrate_plate(find_fiducials(frames, config, INFO, tone=LINEAR), config, intrinsics=None)
    assert view.px_per_mm == pytest.approx(6.3, rel=1e-4)
    assert view.camera_m == pytest.approx((0.0, 0.0, 0.3), abs=1e-3)


def test_a_fiducial_in_the_wrong_place_is_refused():
    config = rig()
    frames = frames_of(tilted_scene(config, shift_mm=1.0), 4)
    with pytest.raises(UserError, match="do the fiducials lie where"):
        calibrate_plate(find_fiducials(frames, config, INFO, tone=LINEAR), config, intrinsics=None)


def test_a_wrong_scale_is_refused():
    config = rig()
    with pytest.raises(UserError, match="correct px_per_mm"):
        calibrate_plate(pixels_of_corners(config, 3.0), config, intrinsics=None)


def pixels_of_corners(config: RigConfig, px_per_mm: float) -> Floats:
    return known_corners_m(config) * (1e3 * px_per_mm, -1e3 * px_per_mm) + 299.5


def test_a_hidden_fiducial_is_named():
    config = rig()
    frames = frames_of(tilted_scene(config), 3).copy()
    frames[:, 500:, :100] = 120
    with pytest.raises(UserError, match="fiducial 4"):
        find_fiducials(frames, config, INFO, tone=LINEAR)


def test_a_moving_plate_is_refused():
    config = rig()
    still = frames_of(tilted_scene(config), 1)[0]
    frames = np.stack([np.roll(still, shift, axis=1) for shift in (0, 1, 2, 3)])
    with pytest.raises(UserError, match="stand still"):
        find_fiducials(frames, config, INFO, tone=LINEAR)


# --- tone, noise, scatter --------------------------------------------------------------------------------------------


def shots(config: RigConfig, options: SyntheticOptions, *, count: int = 6) -> list[Exposed]:
    series: list[Exposed] = []
    for share in (1.0, 0.71, 0.5, 0.35, 0.25, 0.18):
        exposure_ms = share * config.camera.exposure_ms
        camera = dataclasses.replace(config.camera, exposure_ms=exposure_ms)
        view = SyntheticView(dataclasses.replace(config, camera=camera), rng=np.random.default_rng(8), options=options)
        series.append(Exposed(exposure_ms, np.stack([view.frame(scene(), 0) for _ in range(count)])))
    return series


@pytest.fixture(scope="module")
def straight() -> list[Exposed]:
    return shots(rig(), SyntheticOptions(light=1.05))


@pytest.fixture(scope="module")
def curved() -> list[Exposed]:
    return shots(rig(), SyntheticOptions(light=1.05, tone="pi-default"))


def test_a_straight_tone_curve_is_found_straight(straight: list[Exposed]):
    fit = fit_tone(straight, rng=np.random.default_rng(0))
    assert fit.is_linear
    assert fit.bend < 0.006


def test_the_pis_default_curve_is_recovered(curved: list[Exposed]):
    fit = fit_tone(curved, rng=np.random.default_rng(0))
    assert not fit.is_linear
    seen = np.arange(10, 16 * int(fit.highest_value / 16)) / 255.0  # up to the last knot that was reached
    found, true = (np.interp(seen, curve.value, curve.light) for curve in (fit.curve, PI_DEFAULT))
    scale = float(found @ true / (found @ found))  # the scale of light is free
    np.testing.assert_allclose(scale * found, true, atol=0.012)


def test_a_measured_curve_brings_the_corners_back(curved: list[Exposed]):
    config = rig()
    fit = fit_tone(curved, rng=np.random.default_rng(0))
    view = SyntheticView(config, rng=np.random.default_rng(9), options=SyntheticOptions(tone="pi-default"))
    image, true = view.frame_and_corners(scene(0.003, 0.002, 0.3), 0)
    errors = {}
    for name, tone in (("measured", fit.curve), ("ignored", LINEAR)):
        info = dataclasses.replace(view.info, tone=tone)
        report = Observer(config, info).block(Frame(image, 0, 0))
        errors[name] = float(np.abs(np.reshape(report.corners_px, (4, 2)) - true).max())
    assert errors["measured"] < 0.12 < errors["ignored"]


@pytest.mark.parametrize("broken", ["one exposure", "flat", "flicker"])
def test_what_does_not_tell_the_curve_is_refused(straight: list[Exposed], broken: str):
    series = straight
    if broken == "one exposure":
        series = [dataclasses.replace(shot, exposure_ms=2.0) for shot in straight]
    elif broken == "flat":
        series = [dataclasses.replace(shot, frames=np.full_like(shot.frames, 80)) for shot in straight]
    else:
        series = [
            dataclasses.replace(shot, exposure_ms=shot.exposure_ms * (1.5 if number % 2 else 1.0))
            for number, shot in enumerate(straight)
        ]
    with pytest.raises(UserError, match="Expected"):
        fit_tone(series, rng=np.random.default_rng(0))


def test_the_noise_is_recovered():
    config = rig()
    options = SyntheticOptions(light=0.95, full_scale_e=5000.0, read_noise_e=15.0)
    view = SyntheticView(config, rng=np.random.default_rng(8), options=options)
    frames = np.stack([view.frame(scene(), 0) for _ in range(20)])
    noise = fit_noise(Exposed(2.0, frames), LINEAR)
    assert noise is not None
    assert noise.full_scale_e == pytest.approx(5000.0, rel=0.15)
    assert noise.read_noise_e == pytest.approx(15.0, rel=0.5)
    assert fit_noise(Exposed(2.0, np.full((5, 600, 600), 90, np.uint8)), LINEAR) is None


def resting(count: int, *, step_m: float = 0.0, options: SyntheticOptions | None = None) -> tuple[Image, CameraInfo]:
    view = SyntheticView(rig(), rng=np.random.default_rng(8), options=options)
    return np.stack([view.frame(scene(0.002 + number * step_m), 0) for number in range(count)]), view.info


def test_the_scatter_is_that_of_the_corners():
    frames, info = resting(60)
    scatter = measure_scatter(frames, rig(), info)
    observer = Observer(rig(), info)
    corners = np.array([observer.block(Frame(f, n * 10**7, n)).corners_px for n, f in enumerate(frames)])
    # The agent stamps frames as they come, and the tracker smooths by those times: what that changes may not show
    # beside the standard error of a deviation from so many frames.
    standard_error = 1 / math.sqrt(2 * (len(frames) - 1) * corners.shape[1])
    assert scatter.sigma_px == pytest.approx(np.sqrt(corners.var(axis=0, ddof=1).mean()), rel=0.1 * standard_error)
    assert 0.001 < scatter.sigma_px < 0.05
    noisy, info = resting(60, options=SyntheticOptions(full_scale_e=1500.0, read_noise_e=12.0))
    assert measure_scatter(noisy, rig(), info).sigma_px > 1.5 * scatter.sigma_px


def test_a_creeping_block_is_refused():
    frames, info = resting(60, step_m=2e-6)
    with pytest.raises(UserError, match="drift"):
        measure_scatter(frames, rig(), info)


def test_a_missing_mark_is_refused():
    frames, info = resting(10)
    with pytest.raises(UserError, match="in 0 of 10"):
        measure_scatter(np.full_like(frames, 90), rig(), info)


def test_exposures_are_judged_by_light_and_blur():
    bright, info = resting(12)
    dark, _ = resting(12, options=SyntheticOptions(light=0.003))
    rows = [
        exposure_row(bright, rig(), dataclasses.replace(info, exposure_ns=4_000_000)),
        exposure_row(bright, rig(), info),
        exposure_row(dark, rig(), dataclasses.replace(info, exposure_ns=100_000)),
    ]
    assert [row.found for row in rows] == [1.0, 1.0, 0.0]
    assert "exposure_ms = 2.00" in advice(rows, px_per_mm=6.0)
    assert "more light is needed" in advice(rows[2:], px_per_mm=6.0)


# --- all of it -------------------------------------------------------------------------------------------------------


class ViewCamera:
    """A camera that draws one scene, without a clock."""

    def __init__(self, view: SyntheticView) -> None:
        self._view, self._seq = view, 0

    def open(self) -> CameraInfo:
        return self._view.info

    def read(self, timeout_s: float) -> Frame | None:
        del timeout_s
        self._seq += 1
        return Frame(self._view.frame(scene(0.002, -0.001, 0.1), 0), self._seq * 10**7, self._seq)

    def close(self) -> None:
        pass


def opener(config: RigConfig, options: SyntheticOptions) -> Callable[[float], ViewCamera]:
    def open_camera(exposure_ms: float) -> ViewCamera:
        camera = dataclasses.replace(config.camera, exposure_ms=exposure_ms)
        view = SyntheticView(dataclasses.replace(config, camera=camera), rng=np.random.default_rng(1), options=options)
        return ViewCamera(view)

    return open_camera


@pytest.fixture(autouse=True)
def fewer_exposures(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session, "EXPOSURES", (0.5, 0.25))


def test_a_whole_calibration_is_kept_drawn_and_used(tmp_path: Path):
    config = rig()
    result = session.calibrate(
        config,
        opener(config, SyntheticOptions(tone="pi-default", light=0.9)),
        lens=None,
        frames=30,
        rng=np.random.default_rng(0),
        source="calibration.toml",
    )
    assert "residuals" in result.notes
    assert "exposure_ms" in result.notes
    assert "height_mm in [camera] says" not in result.notes
    assert "height_mm in [camera] says 250" in dataclasses.replace(result, height_mm=250.0).notes
    write_calibration(result.calibration, tmp_path / "calibration.toml", notes=result.notes)
    again = load_calibration(tmp_path / "calibration.toml")
    assert again == result.calibration
    picture = draw(result, config)
    assert picture.shape == (600, 1180, 3)
    green = picture[:, :600, 1].astype(int) - picture[:, :600, 0]
    assert np.count_nonzero(green > 40) > 4000  # the grid, which no grey picture has
    # The driver's own tone curve was already the right one: the measured one is kept, and does as well.
    assert again.tone(LINEAR).name == "measured"
    message = geometry_message(again, config, stamp_ns=5)
    assert message.corner_sigma_px == again.corner_sigma_px > 0
    assert message.source == "calibration.toml"
    assert message.mm_per_px == pytest.approx(1 / 6.0, rel=1e-3)
    lens = calibration_message(again, stamp_ns=5)
    assert (lens.width, lens.height, len(lens.K), len(lens.D)) == (600, 600, 9, 5)
    _, place = camera_pose(message, K=np.reshape(lens.K, (3, 3)))
    assert place[2] == pytest.approx(0.3, rel=1e-2)


def test_a_straight_camera_keeps_its_own_curve():
    config = rig()
    result = session.calibrate(
        config, opener(config, SyntheticOptions()), lens=None, frames=30, rng=np.random.default_rng(0)
    )
    assert result.calibration.tone_light == ()
    assert result.calibration.plate_from_pixel == pytest.approx(
        nominal(config, width_px=600, height_px=600).plate_from_pixel, abs=2e-5
    )


def test_a_calibration_file_that_is_wrong_is_named(tmp_path: Path):
    good = nominal(rig(), width_px=600, height_px=600)
    file = tmp_path / "c.toml"
    write_calibration(good, file)
    assert load_calibration(file) == good
    file.write_text(file.read_text().replace("width_px = 600", 'width_px = "wide"'))
    with pytest.raises(UserError, match="width_px"):
        load_calibration(file)
    write_calibration(good, file)
    file.write_text(file.read_text().replace(str(list(good.plate_from_pixel)), str([0.0] * 9)))
    with pytest.raises(UserError, match="plate_from_pixel"):
        load_calibration(file)


def test_a_nominal_calibration_is_where_the_rig_says():
    calibration: Calibration = nominal(rig(), width_px=600, height_px=600)
    assert calibration.mm_per_px == pytest.approx(1 / 6.0)
    assert calibration.tone(PI_DEFAULT) is PI_DEFAULT
    assert SystemClock().now_ns() > 0

"""The bound of a frame: that of a straight edge by its formula, and an efficient estimator comes down to it."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import ndtr

from pi_agent.rendering import Layer, Optics, Pose, Scene, Sensor, surface
from pi_agent.rendering.light import expose, tone_table
from pi_agent.rendering.painting import blur, shrink
from pi_agent.tracking.mark import Mark
from pi_agent.tracking.tone import PI_DEFAULT
from tests.benchmarks.tracking_rivals.bound import bounds, corner_derivatives, pixel_variance, rounded_information
from tests.benchmarks.tracking_rivals.expected import STEP_MM, ExpectedFrame, homography
from tests.benchmarks.tracking_rivals.texture import autocovariance, texture_covariance

PLAIN = surface("plain", rng=np.random.default_rng(0))
READ_NOISE = 0.01  # share of full scale: 2.55 pixel values
EVEN_NOISE = Sensor(full_scale_e=1e9, read_noise_e=READ_NOISE * 1e9)
OPTICS = Optics(vignetting=0.0, blur_px=1.0)
TAPE = Scene(PLAIN, mark=Mark(side_mm=10.0), optics=OPTICS, sensor=EVEN_NOISE)
PX_PER_MM = OPTICS.px_per_mm

Floats = NDArray[np.float64]


def _information(frame: ExpectedFrame) -> Floats:
    """Returns the information of the eight coordinates (8, 8), per px²."""
    columns = corner_derivatives(frame).reshape(-1, 8) / PX_PER_MM
    return columns.T @ (columns / pixel_variance(frame, frame.reflectance()).reshape(-1, 1))


@pytest.mark.parametrize("yaw_rad", [0.0, 0.3, np.pi / 4])
def test_a_square_that_moves_is_told_as_well_as_the_formula_of_its_straight_edges_says(yaw_rad: float) -> None:
    """Variance of an edge's place: noise² / (contrast² × length × integral of the squared line spread)."""
    frame = ExpectedFrame(TAPE, Pose(0.03, 0.05, yaw_rad))
    contrast = 255.0 * TAPE.light * (0.5 - TAPE.ink.dark)
    noise2 = (255.0 * READ_NOISE) ** 2 + 1.0 / 12.0
    spread = np.sqrt(OPTICS.blur_px**2 + 1.0 / 12.0 + 1.0 / 12.0 / frame.quality.fine**2)  # lens, pixel, sub-pixel
    of_an_edge = contrast**2 * 60.0 / (2.0 * np.sqrt(np.pi) * spread) / noise2
    along = np.tile([np.cos(-yaw_rad), np.sin(-yaw_rad)], 4)  # the image's x in the mark's frame
    assert along @ _information(frame) @ along == pytest.approx(2.0 * of_an_edge, rel=0.02)


def test_the_bound_grows_with_noise_and_blur_as_the_formula_says() -> None:
    at = Pose(0.03, 0.05, 0.2)
    usual = bounds(TAPE, at).rms_px()["known"]
    noisier = replace(TAPE, sensor=Sensor(full_scale_e=1e9, read_noise_e=2 * READ_NOISE * 1e9))
    blurred = replace(TAPE, optics=replace(OPTICS, blur_px=2.0))
    assert bounds(noisier, at).rms_px()["known"] == pytest.approx(2.0 * usual, rel=0.02)
    assert bounds(blurred, at).rms_px()["known"] == pytest.approx(np.sqrt(2.0) * usual, rel=0.06)


def test_what_is_not_known_costs_and_what_is_known_helps() -> None:
    grain = surface("wood", rng=np.random.default_rng(5))
    marks = Mark(side_mm=10.0, margin=0.16, feature="dot"), Mark(side_mm=10.0)
    for mark in marks:
        seen = bounds(Scene(grain, mark=mark), Pose(0.03, 0.05, 0.2)).rms_px()
        assert seen["shape"] < seen["known"] < seen["estimated"]
        assert seen["estimated"] < seen["outline"] or mark.feature == "none"
    beside_wood, beside_white = (bounds(Scene(grain, mark=mark), Pose()).rms_px() for mark in reversed(marks))
    assert beside_wood["estimated"] > 1.3 * beside_wood["known"]
    assert beside_white["estimated"] < 1.1 * beside_white["known"]


@pytest.mark.parametrize(("from_px", "least"), [(300.0, 1.1), (200.0, np.inf)], ids=["half an edge", "all of it"])
def test_an_occluder_takes_what_the_covered_edge_tells(from_px: float, least: float) -> None:
    bar = Layer((np.array([[from_px, 255.0], [400.0, 255.0], [400.0, 285.0], [from_px, 285.0]]),), 0.4)
    free, covered = (bounds(scene, Pose()).rms_px() for scene in (TAPE, replace(TAPE, occluders=(bar,))))
    assert covered["known"] >= least * free["known"]
    assert free["known"] < np.inf


def test_saturated_light_tells_nothing() -> None:
    assert bounds(replace(TAPE, light=20.0), Pose()).rms_px()["known"] == np.inf


@pytest.mark.parametrize("deviation", [0.1, 0.3, 0.7, 2.0])
def test_the_information_of_a_rounded_value_is_that_of_its_chances(deviation: float) -> None:
    """Differences of the logarithm of each whole number's chance give it, over all places between two whole numbers."""
    means = np.linspace(100.0, 101.0, 21)
    step, numbers = 1e-4, np.arange(80, 122)

    def chances(mean: float) -> Floats:
        u = (numbers[:, None] + np.array([-0.5, 0.5]) - mean) / deviation
        return np.maximum(np.where(u[:, 0] > 0, ndtr(-u[:, 0]) - ndtr(-u[:, 1]), ndtr(u[:, 1]) - ndtr(u[:, 0])), 1e-200)

    expected = [
        float(np.sum((chances(m + step) - chances(m - step)) ** 2 / chances(m)) / (2 * step) ** 2)
        for m in means.tolist()
    ]
    told = rounded_information(means, np.full_like(means, deviation))
    np.testing.assert_allclose(told, expected, rtol=2e-3)
    if deviation > 0.5:
        np.testing.assert_allclose(told, 1.0 / (deviation**2 + 1.0 / 12.0), rtol=0.02)


def test_the_seen_texture_has_the_covariance_of_surfaces_that_are_really_blurred() -> None:
    """Cut out of many places of a steel plate, half of it covered, seen through the lens."""
    plate = surface("steel", rng=np.random.default_rng(6), size=1500)
    share = np.zeros((24, 24))
    share[:, 12:] = 1.0
    seen = np.zeros((24, 24), dtype=bool)
    seen[10:13, 8:18] = True
    told = texture_covariance(autocovariance(plate, reach=24), seen=seen, open_share=share, blur_px=0.8)
    rng = np.random.default_rng(7)
    samples = []
    for row, column in rng.integers(0, 1590, (6000, 2)).tolist():
        ground = plate[row : row + 24, column : column + 24] - plate.mean()
        fine = np.repeat(np.repeat(ground * share, 4, axis=0), 4, axis=1).astype(np.float32)
        samples.append(_through_the_lens(fine)[seen])
    measured = np.cov(np.array(samples).T, bias=True)
    np.testing.assert_allclose(told, measured, atol=0.12 * float(measured.max()))
    assert np.trace(told) == pytest.approx(np.trace(measured), rel=0.1)


def _through_the_lens(fine: NDArray[np.float32]) -> NDArray[np.float32]:
    return shrink(blur(fine, 0.8 * 4), 4)


@pytest.mark.parametrize("scene", [TAPE, replace(TAPE, sensor=Sensor(tone=PI_DEFAULT))], ids=["linear", "Pi curve"])
def test_maximum_likelihood_comes_down_to_the_bound(scene: Scene) -> None:
    """Gauss-Newton on the rendered model, of real frames with shot noise and rounding; it starts 0.2 px off."""
    frame, frames = ExpectedFrame(scene, Pose(0.03, 0.05, 0.2)), 100
    variance = pixel_variance(frame, frame.reflectance()).ravel()
    columns = corner_derivatives(frame).reshape(-1, 8)
    gain = np.linalg.solve(columns.T @ (columns / variance[:, None]), (columns / variance[:, None]).T)
    rng, table = np.random.default_rng(20261217), tone_table(scene.sensor)
    light, errors = frame.reflectance() * frame.gain + frame.glare, []
    for _ in range(frames):
        shot = expose(light, rng.standard_normal(light.shape, dtype=np.float32), sensor=scene.sensor, table=table)
        guess = frame.corners_mm.ravel() + rng.normal(0.0, 0.03, 8)
        for _ in range(4):
            seen = frame.values(frame.reflectance(guess.reshape(4, 2)) * frame.gain + frame.glare)
            guess = guess + gain @ (shot - seen).ravel()
        errors.append(frame.seen_px(guess.reshape(4, 2)) - frame.seen_px(frame.corners_mm))
    reached = np.sqrt(np.mean(np.sum(np.square(errors), axis=2)))
    bound = bounds(scene, Pose(0.03, 0.05, 0.2)).rms_px()["known"]
    # The RMS of n frames with about five free numbers each scatters by 1 / sqrt(2 × 5 n): 3 %.
    assert reached == pytest.approx(bound, rel=0.1)
    np.testing.assert_allclose(np.mean(errors, axis=0), 0.0, atol=4.0 * bound / np.sqrt(frames))


def test_a_projective_map_takes_the_corners_where_they_are_wanted() -> None:
    start = Mark(side_mm=10.0).corners_mm()
    end = start + STEP_MM * np.random.default_rng(1).normal(size=(4, 2))
    points = np.column_stack([start, np.ones(4)]) @ homography(start, end).T
    np.testing.assert_allclose(points[:, :2] / points[:, 2:], end, atol=1e-12)

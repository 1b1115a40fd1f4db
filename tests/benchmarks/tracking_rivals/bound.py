"""The Cramér-Rao bound of a frame: how exactly any unbiased method can tell the corners of the mark from that frame.

The Fisher information of the parameters is J' S^-1 J. J: the derivatives of the expected frame, by differences of
the renderer. S: the variance of each pixel by shot noise, read noise and rounding, and for a bare tape the covariance
of the plate's texture, which a tracker does not know. Four bounds, from what is taken as known:

- `known`: the whole mark with its dot, notch or code moves as one projective picture; all else is known, the plate too.
- `estimated`: the same, but brightness, black level and blur are estimated from the frame, and a plate that is seen is
  known by its spectrum alone. It is the bound that a ratio is taken to.
- `outline`: `estimated` for a method that reads the four edges of the dark square and nothing inside it.
- `shape`: `estimated` when the mark's shape in the image is known from earlier frames: place and turn are free.

Clutter, occluders, glare, shadows, the speed and the tone curve are taken as known by all of them. The variance of a
pixel grows with its light, which tells a little more about the edges: that is left out (below one part in a hundred
but in the dimmest frames). Beside a bare tape so is what the edge of the texture itself tells.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.special import ndtr

from pi_agent.rendering import Pose, Scene
from pi_agent.rendering.painting import Quality
from tests.benchmarks.tracking_rivals.expected import QUALITY, STEP_MM, ExpectedFrame, Image
from tests.benchmarks.tracking_rivals.texture import autocovariance, texture_covariance

Floats = NDArray[np.float64]

BLUR_STEP_PX = 0.02
WELL_ROUNDED = 1.0  # deviation in pixel values from which rounding adds 1/12 to the variance and does nothing else
SHARE = 3e-3  # share of the largest derivative, below which a pixel tells nothing
UNTOLD = 1e-9  # share of the information that a combination of parameters has at least if the frame tells it


@dataclass(frozen=True)
class Bounds:
    """Covariances (8, 8) of the corners, px: x and y of the first one, of the second, … See above."""

    known: Floats
    estimated: Floats
    outline: Floats
    shape: Floats

    def rms_px(self) -> dict[str, float]:
        """Root mean square distance of the corners from the truth at each of the bounds."""
        return {name: float(np.sqrt(np.trace(covariance) / 4)) for name, covariance in vars(self).items()}


def bounds(scene: Scene, pose: Pose, *, quality: Quality = QUALITY) -> Bounds:
    """The bounds of the frame of a scene."""
    frame = ExpectedFrame(scene, pose, quality=quality)
    noise = pixel_variance(frame, frame.reflectance())
    whole = corner_derivatives(frame)
    inverse_px = _by_mm(frame)
    known = _corners(inverse_px, whole.reshape(-1, 8), partial(_divided, noise.ravel()))
    textured = scene.mark.margin <= 0 and float(scene.plate.std()) > 0.0
    flat = np.full_like(frame.ground, float(frame.ground.mean())) if textured else None
    if flat is not None:
        whole = corner_derivatives(frame, ground=flat)
    outline = whole if scene.mark.feature == "none" else corner_derivatives(frame, with_feature=False)
    nuisance = _nuisances(frame, flat)
    seen = _usable(frame, whole, outline)
    weigh = partial(_divided, noise[seen])
    if textured:
        weigh = _textured(frame, seen, noise)
    turn = np.column_stack(
        [np.tile([1.0, 0.0], 4), np.tile([0.0, 1.0], 4), (frame.corners_mm @ [[0, 1], [-1, 0]]).ravel()]
    )
    return Bounds(
        known,
        _corners(inverse_px, np.hstack([whole[seen], nuisance[seen]]), weigh),
        _corners(inverse_px, np.hstack([outline[seen], nuisance[seen]]), weigh),
        _corners(inverse_px @ turn, np.hstack([whole[seen] @ turn, nuisance[seen]]), weigh),
    )


def corner_derivatives(frame: ExpectedFrame, *, with_feature: bool = True, ground: Image | None = None) -> Floats:
    """Derivatives (h, w, 8) of the pixel values by the coordinates of the corners in the mark's frame, per mm."""
    before = frame.values(_light(frame, frame.reflectance(ground=ground)))
    columns = []
    for step in STEP_MM * np.eye(8).reshape(8, 4, 2):
        moved = frame.reflectance(frame.corners_mm + step, with_feature=with_feature, ground=ground)
        columns.append((frame.values(_light(frame, moved)) - before) / STEP_MM)
    return np.stack(columns, axis=-1)


def pixel_variance(frame: ExpectedFrame, reflectance: Image) -> Floats:
    """One over the information (h, w) that a pixel holds of its expected value: shot and read noise, and rounding."""
    sensor, light = frame.scene.sensor, np.asarray(_light(frame, reflectance), dtype=np.float64)
    of_light = np.sqrt(np.maximum(light, 0.0) / sensor.full_scale_e + (sensor.read_noise_e / sensor.full_scale_e) ** 2)
    up, down = (frame.values((light + way * of_light).astype(np.float32)) for way in (1.0, -1.0))
    deviation = np.maximum(0.5 * (up - down), 1e-3)
    return 1.0 / rounded_information(frame.values(light.astype(np.float32)), deviation)


def rounded_information(mean: Floats, deviation: Floats) -> Floats:
    """Fisher information of the mean of a normal variable that is rounded to whole numbers (…)."""
    information = 1.0 / (deviation**2 + 1.0 / 12.0)
    small = deviation < WELL_ROUNDED
    at, spread = mean[small][:, None], deviation[small][:, None]
    borders = np.floor(at) + np.arange(-9.5, 11.0)
    u = (borders - at) / spread
    mirrored = np.where(u[:, :-1] > 0, -1.0, 1.0)  # above the mean a difference from 1 would be rounding error
    chance = np.maximum(np.abs(ndtr(mirrored * u[:, 1:]) - ndtr(mirrored * u[:, :-1])), 1e-300)
    slope = np.diff(np.exp(-0.5 * u**2) / np.sqrt(2.0 * np.pi), axis=1) / spread
    information[small] = np.maximum(np.sum(slope**2 / chance, axis=1), 1e-12)
    return information


def _light(frame: ExpectedFrame, reflectance: Image) -> Image:
    return reflectance * frame.gain + frame.glare


def _by_mm(frame: ExpectedFrame) -> Floats:
    """Derivatives (8, 8) of the corners as they are seen, px, by those in the mark's frame, mm."""
    steps = STEP_MM * np.eye(8).reshape(8, 4, 2)
    seen = [(frame.seen_px(frame.corners_mm + s) - frame.seen_px(frame.corners_mm - s)).ravel() for s in steps]
    return np.stack(seen, axis=1) / (2.0 * STEP_MM)


def _nuisances(frame: ExpectedFrame, ground: Image | None) -> Floats:
    """Derivatives (h, w, 3) by brightness, black level and blur."""
    painted, blur_px = frame.reflectance(ground=ground), frame.scene.optics.blur_px
    light = _light(frame, painted)
    changed = [(light + way * 1e-3 * painted * frame.gain, light + way * 1e-3) for way in (1, -1)]
    widths = [_light(frame, frame.reflectance(blur_px=blur_px + way * BLUR_STEP_PX, ground=ground)) for way in (1, -1)]
    pairs = [*zip(*changed, strict=True), widths]
    return np.stack([frame.values(after) - frame.values(before) for after, before in pairs], axis=-1)


def _usable(frame: ExpectedFrame, whole: Floats, outline: Floats) -> NDArray[np.bool_]:
    """The pixels (h, w) near what moves; with a margin those alone that see nothing of the plate."""
    size = np.abs(whole).max(axis=-1) + np.abs(outline).max(axis=-1)
    near = size > SHARE * size.max()
    if frame.scene.mark.margin > 0:
        near &= _uncovered(frame, frame.scene.optics.blur_px) < SHARE
    return near


def _uncovered(frame: ExpectedFrame, blur_px: float) -> Floats:
    """The share (h, w) of the plate's light that comes past the mark and other things."""
    grounds = np.ones_like(frame.ground), np.zeros_like(frame.ground)
    white, black = (frame.reflectance(blur_px=blur_px, ground=ground) for ground in grounds)
    return np.asarray(white - black, dtype=np.float64)


def _textured(frame: ExpectedFrame, seen: NDArray[np.bool_], noise: Floats) -> partial[Floats]:
    """Applies the inverse of the pixels' covariance, the plate's texture included."""
    lags = autocovariance(frame.scene.plate, reach=max(seen.shape))
    share = _uncovered(frame, 0.0)
    covariance = texture_covariance(lags, seen=seen, open_share=share, blur_px=frame.scene.optics.blur_px)
    slope = _value_slope(frame)[seen]
    covariance *= slope[:, None] * slope
    covariance[np.diag_indices_from(covariance)] += noise[seen]
    return partial(_solved, cho_factor(covariance, lower=True, overwrite_a=True, check_finite=False))


def _value_slope(frame: ExpectedFrame) -> Floats:
    """The change (h, w) of pixel values by reflectance."""
    light = _light(frame, frame.reflectance())
    step = np.float32(2e-3)
    slope = (frame.values(light + step) - frame.values(light - step)) / (2.0 * float(step))
    return slope * np.asarray(frame.gain, dtype=np.float64)


def _divided(variance: Floats, columns: Floats) -> Floats:
    return columns / variance[:, None]


def _solved(factor: tuple[Floats, bool], columns: Floats) -> Floats:
    return np.asarray(cho_solve(factor, columns, check_finite=False))


def _corners(to_px: Floats, columns: Floats, weigh: partial[Floats]) -> Floats:
    """The corners' covariance (8, 8): `to_px` (8, k) takes the first k of the parameters to them.

    Infinite if the frame does not hold them all, as when one edge is covered from end to end.
    """
    information = columns.T @ weigh(columns)
    wanted = to_px.shape[1]
    scale = np.sqrt(np.diag(information))
    scale[:wanted] = scale[:wanted].max()  # one for all corners, or one that is not told would seem to be
    if scale.min() <= 0.0:
        return np.full((8, 8), np.inf)
    scaled = information / np.outer(scale, scale)
    if np.linalg.eigvalsh(scaled)[0] < UNTOLD:
        return np.full((8, 8), np.inf)
    covariance = np.linalg.inv(scaled) / np.outer(scale, scale)
    return to_px @ covariance[:wanted, :wanted] @ to_px.T

"""One calibration, step by step: frames from the camera, tone curve, plate, scatter; refused at the first bad step."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pi_agent.calibration.lens import Lens
from pi_agent.calibration.model import Calibration
from pi_agent.calibration.plate import PlateView, assumed_intrinsics, calibrate_plate, find_fiducials
from pi_agent.calibration.scatter import ExposureRow, Scatter, advice, exposure_row, exposure_table, measure_scatter
from pi_agent.calibration.tone import Exposed, Noise, ToneFit, fit_noise, fit_tone
from pi_agent.cameras import Camera, CameraInfo, Image
from shared.errors import UserError
from shared.rig import RigConfig

OpenCamera = Callable[[float], Camera]
"""Gives the rig's camera for an exposure in milliseconds."""
EXPOSURES = tuple(2.0 ** (-0.5 * step) for step in range(1, 7))
"""The shorter exposures that are tried, as shares of the rig's own."""
SERIES_FRAMES = 20
SETTLE_FRAMES = 6
PLATE_FRAMES = 30
SILENCE_S = 5.0
HEIGHT_SHARE = 0.1
"""A camera that is measured to stand so much higher or lower than the rig file says is worth a word."""


@dataclass(frozen=True)
class Taken:
    """The camera's words about itself, and its frames (n, height, width) uint8."""

    info: CameraInfo
    frames: Image


@dataclass(frozen=True)
class Result:
    """The calibration, and all that was found on the way; `height_mm`: of the camera, as the rig file has it."""

    calibration: Calibration
    frame: Image
    plate: PlateView
    scatter: Scatter
    tone: ToneFit | None
    noise: Noise | None
    exposures: tuple[ExposureRow, ...]
    lens: Lens | None
    height_mm: float

    @property
    def notes(self) -> str:
        """The findings in words: residuals first."""
        plate, scatter = self.plate, self.scatter
        x, y, z = (1e3 * value for value in plate.camera_m)
        lines = [
            _lens_note(self.lens),
            f"Plate: residuals {plate.rms_px:.3f} px RMS ({1e3 * plate.rms_px / plate.px_per_mm:.0f} µm) over 16 "
            f"corners; {plate.px_per_mm:.3f} px/mm; camera at x {x:.1f}, y {y:.1f}, {z:.1f} mm above the plate, view "
            f"tilted by {np.degrees(plate.tilt_rad):.2f}°",
            _tone_note(self.tone),
            f"Noise: {self.noise.full_scale_e:.0f} electrons at full scale, {self.noise.read_noise_e:.1f} of read noise"
            if self.noise
            else "Noise: not told by this picture",
            f"Resting corner: scatters by {scatter.sigma_px:.4f} px (the tracker says {scatter.said_px:.4f}) over "
            f"{scatter.frames} frames",
        ]
        if abs(z - self.height_mm) > HEIGHT_SHARE * self.height_mm:
            lines.insert(
                2,
                f"The camera is {z:.0f} mm above the plate where height_mm in [camera] says {self.height_mm:.0f}: "
                "correct it, or was the lens (--lens) another one, or at another focus?",
            )
        if self.exposures:
            lines += ["Exposure against motion blur:"]
            lines += exposure_table(list(self.exposures), px_per_mm=plate.px_per_mm)
            lines += [advice(list(self.exposures), px_per_mm=plate.px_per_mm)]
        return "\n".join(lines)


def calibrate(
    rig: RigConfig,
    open_camera: OpenCamera,
    *,
    lens: Lens | None,
    frames: int,
    rng: np.random.Generator,
    with_tone: bool = True,
    source: str = "calibration",
) -> Result:
    """Calibrates the rig's camera on its level plate, with the block at rest on it.

    Raises:
        UserError: when a step is not good enough; nothing is to be kept then.
    """
    base = take(open_camera(rig.camera.exposure_ms), count=frames)
    if lens is not None:
        _check_size(lens, base.info)
    series = _series(rig, open_camera) if with_tone else []
    tone = _tone([base, *series], rng) if series else None
    keep_own = tone is None or (tone.is_linear and base.info.tone.is_linear)
    curve = base.info.tone if keep_own or tone is None else tone.curve
    info = dataclasses.replace(base.info, tone=curve)
    plate = _plate(base.frames[:PLATE_FRAMES], rig, info, lens)
    scatter = measure_scatter(base.frames, rig, info)
    rows = [exposure_row(shot.frames, rig, dataclasses.replace(shot.info, tone=curve)) for shot in [base, *series]]
    noise = fit_noise(Exposed(info.exposure_ns / 1e6, base.frames[:SERIES_FRAMES]), curve)
    matrix = assumed_intrinsics(rig, px_per_mm=plate.px_per_mm) if lens is None else lens.intrinsics
    calibration = Calibration(
        source=source,
        width_px=info.width_px,
        height_px=info.height_px,
        focal_px=(float(matrix[0, 0]), float(matrix[1, 1])),
        centre_px=(float(matrix[0, 2]), float(matrix[1, 2])),
        distortion=lens.distortion if lens is not None else (0.0,) * 5,
        plate_from_pixel=tuple(plate.plate_from_pixel.ravel().tolist()),
        camera_m=plate.camera_m,
        corner_sigma_px=scatter.sigma_px,
        tone_light=() if keep_own else curve.light,
        tone_value=() if keep_own else curve.value,
    )
    kept = tuple(rows) if series else ()
    return Result(calibration, base.frames[0], plate, scatter, tone, noise, kept, lens, rig.camera.height_mm)


def take(camera: Camera, *, count: int, settle: int = SETTLE_FRAMES) -> Taken:
    """Returns `count` frames of a camera, after a few that are thrown away.

    Raises:
        UserError: if the camera cannot be had or falls silent.
    """
    try:
        info = camera.open()
        frames = np.empty((count, info.height_px, info.width_px), dtype=np.uint8)
        last_s, number = time.monotonic(), -settle
        while number < count:
            frame = camera.read(0.5)
            if frame is not None:
                if number >= 0:
                    frames[number] = frame.image
                number, last_s = number + 1, time.monotonic()
            elif time.monotonic() - last_s > SILENCE_S:
                raise UserError(f"No frame from the camera for {SILENCE_S} s: check its cable")
        return Taken(info, frames)
    finally:
        camera.close()


def _series(rig: RigConfig, open_camera: OpenCamera) -> list[Taken]:
    return [take(open_camera(share * rig.camera.exposure_ms), count=SERIES_FRAMES) for share in EXPOSURES]


def _tone(shots: list[Taken], rng: np.random.Generator) -> ToneFit:
    series = [Exposed(shot.info.exposure_ns / 1e6, shot.frames[:SERIES_FRAMES]) for shot in shots]
    try:
        return fit_tone(series, rng=rng)
    except UserError as error:
        raise UserError(f"{error} (--no-tone leaves the tone curve as the driver says)") from error


def _plate(frames: Image, rig: RigConfig, info: CameraInfo, lens: Lens | None) -> PlateView:
    corners = find_fiducials(frames, rig, info, tone=info.tone)
    if lens is None:
        return calibrate_plate(corners, rig, intrinsics=None)
    return calibrate_plate(corners, rig, intrinsics=lens.intrinsics, distortion=lens.distortion)


def _check_size(lens: Lens, info: CameraInfo) -> None:
    if lens.size_px != (info.width_px, info.height_px):
        raise UserError(
            f"Expected lens pictures of {info.width_px} x {info.height_px}, as the camera gives them, got "
            f"{lens.size_px[0]} x {lens.size_px[1]}: take them with --take"
        )


def _lens_note(lens: Lens | None) -> str:
    if lens is None:
        return "Lens: not measured (--lens); taken as a pinhole at height_mm without distortion"
    return (
        f"Lens: residuals {lens.rms_px:.3f} px RMS over {lens.corners} corners in {len(lens.view_rms_px)} views; focal "
        f"length {lens.intrinsics[0, 0]:.1f} ± {lens.focal_sigma_px:.1f} px; {100 * lens.coverage:.0f} % of the picture"
    )


def _tone_note(tone: ToneFit | None) -> str:
    if tone is None:
        return "Tone curve: not measured, taken as the driver says"
    kind = "straight" if tone.is_linear else "not straight; it is undone on the pixels"
    return (
        f"Tone curve: {kind} (at most {100 * tone.bend:.1f} % of full scale off a line; residual "
        f"{100 * tone.residual:.2f} %; seen up to value {tone.highest_value:.0f})"
    )

"""A camera's calibration, and the messages that carry it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking.tone import ToneCurve
from shared import frames
from shared.errors import UserError
from shared.foxglove import CameraCalibration
from shared.geometry import plate_from_pixel
from shared.messages import CameraGeometry
from shared.possible import LARGEST, LEAST, invertible, require_measurable
from shared.rig import RigConfig


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """The calibration of one camera over one plate.

    `focal_px`, `centre_px`, `distortion` (k1, k2, p1, p2, k3): the pinhole and its lens, as OpenCV has them;
    `plate_from_pixel`: nine numbers, row by row, from undistorted pixels to metres on the plate; `camera_m`: the
    pinhole in the plate frame; `corner_sigma_px`: a resting corner's scatter; `tone_light` and `tone_value`: the tone
    curve's points when it was measured (empty: the driver's own).
    """

    source: str
    width_px: int
    height_px: int
    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    plate_from_pixel: tuple[float, ...]
    camera_m: tuple[float, float, float]
    distortion: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0)
    corner_sigma_px: float = 0.0
    tone_light: tuple[float, ...] = ()
    tone_value: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Refuses what is no calibration; a recording's is a stranger's."""
        require_measurable(self)
        if len(self.plate_from_pixel) != 9 or invertible("plate_from_pixel", self.plate_from_pixel):
            raise ValueError("expected nine numbers of an invertible matrix for 'plate_from_pixel'")
        if min(self.focal_px) <= 0 or self.camera_m[2] <= 0:
            raise ValueError("expected a positive focal length and the camera above the plate")
        with np.errstate(all="ignore"):
            if not LEAST <= self.mm_per_px <= LARGEST:
                raise ValueError(
                    f"expected {LEAST:g} to {LARGEST:g} mm per pixel from 'plate_from_pixel' and 'centre_px', got "
                    f"{self.mm_per_px:g}"
                )
        if len(self.tone_light) != len(self.tone_value):
            raise ValueError("expected as many numbers in 'tone_light' as in 'tone_value'")

    @property
    def homography(self) -> NDArray[np.float64]:
        """`plate_from_pixel` as a matrix (3, 3)."""
        return np.reshape(np.asarray(self.plate_from_pixel, dtype=np.float64), (3, 3))

    @property
    def intrinsics(self) -> NDArray[np.float64]:
        """The pinhole's matrix K (3, 3)."""
        (fx, fy), (cx, cy) = self.focal_px, self.centre_px
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    @property
    def mm_per_px(self) -> float:
        """Millimetres on the plate per pixel, in the middle of the picture."""
        w = self.homography @ np.array([*self.centre_px, 1.0])
        # The homography's Jacobian there; the root of its determinant is the scale that both directions share.
        jacobian = (self.homography[:2, :2] * w[2] - np.outer(w[:2], self.homography[2, :2])) / w[2] ** 2
        return 1e3 * float(np.sqrt(abs(np.linalg.det(jacobian))))

    def tone(self, otherwise: ToneCurve) -> ToneCurve:
        """Returns the measured tone curve, or the driver's."""
        return ToneCurve("measured", self.tone_light, self.tone_value) if self.tone_light else otherwise


def nominal(rig: RigConfig, *, width_px: int, height_px: int) -> Calibration:
    """Returns the calibration that the rig file's `px_per_mm` and `height_mm` stand for.

    They stand for a camera that looks straight down.

    Raises:
        UserError: if no camera has such a view.
    """
    camera = rig.camera
    centre = ((width_px - 1) / 2, (height_px - 1) / 2)
    focal = camera.px_per_mm * camera.height_mm
    homography = plate_from_pixel(px_per_m=1e3 * camera.px_per_mm, centre_px=centre)
    try:
        return Calibration(
            source="nominal",
            width_px=width_px,
            height_px=height_px,
            focal_px=(focal, focal),
            centre_px=centre,
            plate_from_pixel=tuple(homography.ravel().tolist()),
            camera_m=(0.0, 0.0, 1e-3 * camera.height_mm),
        )
    except ValueError as error:
        raise UserError(
            f"Expected a camera's view from [camera] px_per_mm and height_mm, got {camera.px_per_mm:g} and "
            f"{camera.height_mm:g}: {error}"
        ) from error


def calibration_message(calibration: Calibration, *, stamp_ns: int) -> CameraCalibration:
    """Returns the message for `camera/calibration`."""
    return frames.calibration(
        width_px=calibration.width_px,
        height_px=calibration.height_px,
        K=calibration.intrinsics,
        distortion=calibration.distortion,
        stamp_ns=stamp_ns,
    )


def geometry_message(calibration: Calibration, rig: RigConfig, *, stamp_ns: int) -> CameraGeometry:
    """Returns the message for `camera/geometry`."""
    x, y, height = calibration.camera_m
    return CameraGeometry(
        stamp_ns=stamp_ns,
        plate_from_pixel=calibration.plate_from_pixel,
        mm_per_px=calibration.mm_per_px,
        marker_side_m=1e-3 * rig.mark.side_mm,
        marker_aspect=rig.mark.aspect,
        mark_height_m=rig.block.size_m[2],
        camera_x_m=x,
        camera_y_m=y,
        camera_height_m=height,
        corner_sigma_px=calibration.corner_sigma_px,
        source=calibration.source,
    )

"""The plate: where each pixel lies on it, and where the camera is above it, from the fiducials in its corners."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from pi_agent.calibration.lens import undistorted
from pi_agent.cameras import CameraInfo, Image
from pi_agent.marks import FIDUCIAL_MARGIN, fiducial_mark, fiducial_places_mm
from pi_agent.tracking.config import TrackerConfig
from pi_agent.tracking.tone import ToneCurve
from pi_agent.tracking.tracker import Tracker
from shared.errors import UserError
from shared.geometry import apply_homography, mark_corners
from shared.rig import RigConfig

Floats = NDArray[np.float64]

WORST_RMS_PX = 0.5
WORST_MOTION_PX = 0.3
LEAST_FOUND = 0.8
POSE_NUMBERS = 6
"""Three turns and three shifts are fitted to the 32 coordinates."""
SIDE_RANGE = (0.65, 1.5)
SCALE_RANGE = (0.7, 1.4)
"""The measured scale over `px_per_mm`; further off, some number in the rig file is wrong."""


@dataclass(frozen=True)
class PlateView:
    """The map to the plate and its residuals.

    `corners_px` and `residuals_px`: (16, 2), the fiducials' corners as seen (undistorted) and what the map leaves of
    them; `camera_m`: the pinhole in the plate frame; `tilt_rad`: between the view and the plate's normal.
    """

    plate_from_pixel: Floats
    corners_px: Floats
    residuals_px: Floats
    rms_px: float
    px_per_mm: float
    camera_m: tuple[float, float, float]
    tilt_rad: float


def known_corners_m(rig: RigConfig) -> Floats:
    """Returns the sixteen corners (16, 2) of the fiducials in the plate frame, metres: fiducial after fiducial."""
    square = mark_corners(side_m=1e-3 * rig.plate.fiducial_side_mm)
    return np.concatenate([square + 1e-3 * np.array(place) for place in fiducial_places_mm(rig.plate)])


def find_fiducials(frames: Image, rig: RigConfig, info: CameraInfo, *, tone: ToneCurve) -> Floats:
    """Finds the sixteen corners (16, 2) in pixels, means over the frames (n, height, width).

    They are those of one fiducial in each quarter.

    Raises:
        UserError: if one is not found, or moves.
    """
    height, width = frames.shape[1:]
    quarters = ((0, 0), (width // 2, 0), (width // 2, height // 2), (0, height // 2))
    side = rig.plate.fiducial_side_mm * rig.camera.px_per_mm
    corners: list[Floats] = []
    for number, (left, top) in enumerate(quarters, start=1):
        config = TrackerConfig(
            mark=fiducial_mark(rig.plate),
            side_px=(SIDE_RANGE[0] * side, SIDE_RANGE[1] * side),
            tone=tone,
            shutter=info.row_times,
            region_px=(left, top, width // 2, height // 2),
        )
        corners.append(_resting(frames, Tracker(config), name=f"fiducial {number}"))
    return np.concatenate(corners)


def _resting(frames: Image, tracker: Tracker, *, name: str) -> Floats:
    seen = [tracker.track(frame, capture_ns=number * 10_000_000) for number, frame in enumerate(frames)]
    found = np.array([report.corners_px for report in seen if report.found])
    if len(found) < LEAST_FOUND * len(seen):
        reasons = sorted({report.reason for report in seen if not report.found})
        raise UserError(
            f"Expected {name} in its quarter of the picture, found it in {len(found)} of {len(seen)} frames "
            f"({'; '.join(reasons)}): are fiducial_side_mm and px_per_mm right, is its white rim "
            f"{FIDUCIAL_MARGIN} sides wide, is it lit and free?"
        )
    motion = float(found.std(axis=0).max())
    if motion > WORST_MOTION_PX:
        raise UserError(f"Expected a plate at rest, but {name} moves by {motion:.2f} px: let the rig stand still")
    return found.mean(axis=0)


def calibrate_plate(
    corners_px: Floats, rig: RigConfig, *, intrinsics: Floats | None, distortion: tuple[float, ...] = ()
) -> PlateView:
    """Returns the map from pixels to the plate by the fiducials' corners.

    Args:
        corners_px: (16, 2) the corners of the four fiducials, px.
        rig: the rig file's values, which say where the fiducials lie.
        intrinsics: (3, 3) the lens's, px; without it, the camera is taken to be `height_mm` above the plate, which then
            gives the focal length.
        distortion: OpenCV's numbers for the lens; none for an ideal one.

    Raises:
        UserError: when what was seen does not fit the plate that the rig file describes.
    """
    known_m = known_corners_m(rig)
    ideal_px = corners_px if intrinsics is None else undistorted(corners_px, intrinsics, distortion)
    found = cv2.findHomography(ideal_px, known_m, 0)[0]
    if found is None:  # pyright: ignore[reportUnnecessaryComparison]  # OpenCV's stubs leave this case out
        raise UserError("Expected four fiducials in the corners of a square, got corners that lie on a line")
    scale = _px_per_mm(np.asarray(np.linalg.inv(found), dtype=np.float64))
    _refuse_scale(scale, rig)
    matrix = assumed_intrinsics(rig, px_per_mm=scale) if intrinsics is None else intrinsics
    rotation, shift_m = _pose(known_m, ideal_px, matrix)
    inverse = matrix @ np.column_stack([rotation[:, :2], shift_m])
    residuals = ideal_px - apply_homography(inverse, known_m)
    rms_px = float(np.sqrt(np.sum(residuals**2) / (residuals.size - POSE_NUMBERS)))
    _refuse_residuals(rms_px, scale)
    homography = np.asarray(np.linalg.inv(inverse), dtype=np.float64)
    x, y, z = (-rotation.T @ shift_m).tolist()
    tilt_rad = math.acos(min(1.0, abs(float(rotation[2, 2]))))
    return PlateView(homography / homography[2, 2], ideal_px, residuals, rms_px, scale, (x, y, z), tilt_rad)


def _pose(known_m: Floats, ideal_px: Floats, intrinsics: Floats) -> tuple[Floats, Floats]:
    """Returns camera_from_plate as rotation (3, 3) and shift (3,).

    A free homography would do for the map, but it takes in any four places: a fiducial that lies wrong would be hidden
    in it, and is told by the residuals of a rigid pose.
    """
    points = np.column_stack([known_m, np.zeros(len(known_m))])
    _, turn, shift = cv2.solvePnP(points, ideal_px, intrinsics, np.zeros(5), flags=cv2.SOLVEPNP_ITERATIVE)
    return np.asarray(cv2.Rodrigues(turn)[0], dtype=np.float64), np.asarray(shift, dtype=np.float64).ravel()


def _px_per_mm(pixel_from_plate: Floats) -> float:
    """Returns the scale in the plate's middle: the root of the Jacobian's determinant there."""
    h = pixel_from_plate / pixel_from_plate[2, 2]
    jacobian = h[:2, :2] - np.outer(h[:2, 2], h[2, :2])
    return 1e-3 * math.sqrt(abs(float(np.linalg.det(jacobian))))


def assumed_intrinsics(rig: RigConfig, *, px_per_mm: float) -> Floats:
    """Returns K (3, 3) of a camera at `height_mm` with the scale seen, for want of a measured lens."""
    focal = px_per_mm * rig.camera.height_mm
    centre = (rig.camera.width_px - 1) / 2, (rig.camera.height_px - 1) / 2
    return np.array([[focal, 0.0, centre[0]], [0.0, focal, centre[1]], [0.0, 0.0, 1.0]])


def _refuse_scale(px_per_mm: float, rig: RigConfig) -> None:
    ratio = px_per_mm / rig.camera.px_per_mm
    if not SCALE_RANGE[0] <= ratio <= SCALE_RANGE[1]:
        raise UserError(
            f"Expected about {rig.camera.px_per_mm:.2f} px/mm, got {px_per_mm:.2f}: correct px_per_mm in [camera], or "
            "fiducial_place_mm in [plate]"
        )


def _refuse_residuals(rms_px: float, px_per_mm: float) -> None:
    if rms_px > WORST_RMS_PX:
        raise UserError(
            f"Expected residuals below {WORST_RMS_PX} px, got {rms_px:.2f} px ({rms_px / px_per_mm:.2f} mm): do the "
            "fiducials lie where fiducial_place_mm says, and is the lens measured (--lens)?"
        )

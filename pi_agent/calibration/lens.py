"""The lens: pinhole and distortion from pictures of a ChArUco board (Zhang 2000, as OpenCV does it)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from pi_agent.cameras import Image
from shared.errors import UserError

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]

FEWEST_VIEWS = 8
FEWEST_CORNERS = 8
WORST_RMS_PX = 0.5
LEAST_COVERAGE = 0.5
CELLS = 6
"""The picture is divided into 6 × 6 cells to see how much of it the board has been in."""
LEAST_TILT_RAD = 0.17
"""Boards that all lie parallel to the picture do not tell the focal length from the distance."""


@dataclass(frozen=True)
class BoardSpec:
    """A chessboard with ArUco marks in its white squares; `mark_mm` is 0.75 of the square."""

    columns: int = 9
    rows: int = 7
    square_mm: float = 6.0
    dictionary: str = "4X4_50"

    @property
    def board(self) -> cv2.aruco.CharucoBoard:
        """OpenCV's board, in metres."""
        table = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{self.dictionary}"))
        side_m = 1e-3 * self.square_mm
        return cv2.aruco.CharucoBoard((self.columns, self.rows), side_m, 0.75 * side_m, table)

    def picture(self, *, px_per_square: int = 120) -> Image:
        """Returns the board to print (h, w), pixel values, with a white rim half a square wide."""
        rim = px_per_square // 2
        size = (self.columns * px_per_square + 2 * rim, self.rows * px_per_square + 2 * rim)
        return np.asarray(self.board.generateImage(size, marginSize=rim), dtype=np.uint8)

    @staticmethod
    def parse(text: str) -> BoardSpec:
        """Reads words like `9x7x6` (columns, rows, millimetres a square).

        Raises:
            UserError: if they are not that.
        """
        parts = text.split("x")
        try:
            columns, rows, square_mm = int(parts[0]), int(parts[1]), float(parts[2])
        except (ValueError, IndexError):
            columns = rows = 0
            square_mm = 0.0
        if len(parts) != 3 or min(columns, rows) < 3 or square_mm <= 0:
            raise UserError(f"Expected a board like 9x7x6 (columns, rows, millimetres a square), got '{text}'")
        return BoardSpec(columns, rows, square_mm)


@dataclass(frozen=True)
class Lens:
    """Pinhole and distortion, and how well they fit: RMS over all corners, and of each view (px)."""

    intrinsics: Floats
    distortion: tuple[float, ...]
    rms_px: float
    view_rms_px: tuple[float, ...]
    coverage: float
    focal_sigma_px: float
    corners: int
    size_px: tuple[int, int]

    def undistorted(self, points_px: Floats) -> Floats:
        """Returns pixels `points_px` (n, 2), px, as an ideal pinhole with the same matrix would have them."""
        return undistorted(points_px, self.intrinsics, self.distortion)


def undistorted(points_px: Floats, intrinsics: Floats, distortion: tuple[float, ...]) -> Floats:
    """Returns pixels `points_px` (n, 2), px, as an ideal pinhole with the same matrix would have them.

    Args:
        points_px: (n, 2) pixels of the distorted picture, px.
        intrinsics: (3, 3) the camera's matrix, px.
        distortion: OpenCV's numbers; none for an ideal lens.
    """
    if not any(distortion):
        return np.asarray(points_px, dtype=np.float64)
    points = np.asarray(points_px, dtype=np.float64).reshape(-1, 1, 2)
    ideal = cv2.undistortPoints(points, intrinsics, np.array(distortion), P=intrinsics)
    return np.asarray(ideal, dtype=np.float64).reshape(-1, 2)


def calibrate_lens(pictures: Iterable[Image], spec: BoardSpec) -> Lens:
    """Returns the lens from pictures (height, width) of the board, held at many places and tilts.

    Raises:
        UserError: when the pictures are too few, too much alike, or do not fit one lens.
    """
    board, detector = spec.board, cv2.aruco.CharucoDetector(spec.board)
    seen: list[Singles] = []
    known: list[Singles] = []
    size = (0, 0)
    total = 0
    for picture in pictures:
        total += 1
        size = (picture.shape[1], picture.shape[0])
        corners, ids, _, _ = detector.detectBoard(picture)
        # OpenCV gives None when it sees no board, which its stubs leave out.
        if ids is not None and len(ids) >= FEWEST_CORNERS:  # pyright: ignore[reportUnnecessaryComparison]
            objects, images = board.matchImagePoints(list(corners), ids)  # pyright: ignore[reportArgumentType]  # stubs
            known.append(np.asarray(objects, dtype=np.float32).reshape(-1, 3))
            seen.append(np.asarray(images, dtype=np.float32).reshape(-1, 2))
    if len(seen) < FEWEST_VIEWS:
        what = (
            f"is --board {spec.columns}x{spec.rows}x{spec.square_mm:g} what was printed, is it sharp and wholly lit?"
            if len(seen) < total
            else "take more of them (--take)"
        )
        raise UserError(
            f"Expected the board in at least {FEWEST_VIEWS} pictures, got it in {len(seen)} of {total}: {what}"
        )
    lens = _fit(known, seen, size)
    _refuse(lens)
    return lens


def _fit(known: list[Singles], seen: list[Singles], size: tuple[int, int]) -> Lens:
    # The third radial term is left out: on lenses of this kind it fits noise.
    rms, matrix, distortion, turns, shifts, sigmas, _, views = cv2.calibrateCameraExtended(
        known, seen, size, np.eye(3), np.zeros(5), flags=cv2.CALIB_FIX_K3
    )
    del shifts
    _refuse_flat([np.asarray(turn, dtype=np.float64) for turn in turns])
    return Lens(
        np.asarray(matrix, dtype=np.float64),
        tuple(np.ravel(distortion)[:5].tolist()),
        float(rms),
        tuple(np.ravel(views).tolist()),
        _coverage(np.concatenate(seen), size),
        float(np.ravel(sigmas)[0]),
        sum(len(points) for points in seen),
        size,
    )


def _coverage(points: Singles, size: tuple[int, int]) -> float:
    """Returns the share of the picture's cells in which a corner has been."""
    cells = np.floor(points / np.array(size) * CELLS).astype(int)
    return len({(int(x), int(y)) for x, y in cells}) / CELLS**2


def _refuse_flat(turns: list[Floats]) -> None:
    normals = np.array([cv2.Rodrigues(turn)[0][:, 2] for turn in turns], dtype=np.float64)
    tilts = np.arccos(np.clip(np.abs(normals[:, 2]), 0.0, 1.0))
    if float(tilts.max()) < LEAST_TILT_RAD:
        raise UserError(
            f"Expected boards tilted by {np.degrees(LEAST_TILT_RAD):.0f}° and more, got at most "
            f"{np.degrees(tilts.max()):.0f}°: without tilt the focal length cannot be told from the distance"
        )


def _refuse(lens: Lens) -> None:
    if lens.rms_px > WORST_RMS_PX:
        worst = int(np.argmax(lens.view_rms_px))
        raise UserError(
            f"Expected residuals below {WORST_RMS_PX} px, got {lens.rms_px:.2f} px (worst: view {worst + 1} of "
            f"{len(lens.view_rms_px)}, {lens.view_rms_px[worst]:.2f} px): is the board flat, were the pictures still?"
        )
    if lens.coverage < LEAST_COVERAGE:
        raise UserError(
            f"Expected the board to have been in {100 * LEAST_COVERAGE:.0f} % of the picture, got "
            f"{100 * lens.coverage:.0f} %: take pictures with the board near every edge"
        )

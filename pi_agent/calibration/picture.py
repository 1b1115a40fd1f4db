"""The calibration as a picture, because a wrong one is seen at once."""

from __future__ import annotations

import re

import cv2
import numpy as np
from numpy.typing import NDArray

from pi_agent.calibration.session import Result
from pi_agent.calibration.tone import KNOTS
from shared.geometry import apply_homography
from shared.rig import RigConfig

Floats = NDArray[np.float64]
Colour = tuple[int, int, int]

GRID_STEP_MM = 10
MAGNIFIED = 200
"""Residuals are drawn so many times longer than they are."""
GREEN: Colour = (80, 220, 80)
RED: Colour = (60, 60, 255)
GREY: Colour = (150, 150, 150)
WHITE: Colour = (240, 240, 240)
PANEL_PX = 580
FONT_SIZE = 0.36
COLUMNS_PX = (20, 95, 155, 250, 350)
"""The places at which the columns of the table of exposures begin."""


def draw(result: Result, rig: RigConfig) -> NDArray[np.uint8]:
    """Returns the picture (h, w, 3), pixel values in blue, green and red.

    It shows the frame, and a panel with tone curve and words.

    The frame has the plate's grid and the fiducials' residuals, magnified.
    """
    view = np.repeat(result.frame[:, :, None], 3, axis=2)
    _grid(view, result, rig)
    _residuals(view, result)
    return np.asarray(np.hstack([view, _panel(result, view.shape[0])]), dtype=np.uint8)


def _grid(view: NDArray[np.uint8], result: Result, rig: RigConfig) -> None:
    """Draws lines of the plate, a centimetre apart, where the calibration sees them."""
    reach = int(500 * rig.plate.side_m) // GRID_STEP_MM * GRID_STEP_MM
    along = np.linspace(-reach, reach, 41)
    for place in range(-reach, reach + 1, GRID_STEP_MM):
        for line in (np.column_stack([np.full(41, place), along]), np.column_stack([along, np.full(41, place)])):
            points = np.round(_seen(result, 1e-3 * line) * 16).astype(np.int32)
            cv2.polylines(view, [points.reshape(-1, 1, 2)], False, GREEN, 1, cv2.LINE_AA, 4)


def _seen(result: Result, points_m: Floats) -> Floats:
    """Returns pixels (n, 2), distortion included, of points (n, 2) of the plate."""
    calibration = result.calibration
    inverse = np.asarray(np.linalg.inv(calibration.homography), dtype=np.float64)
    ideal = apply_homography(inverse, points_m)
    if not any(calibration.distortion):
        return ideal
    rays = np.column_stack([(ideal - calibration.centre_px) / calibration.focal_px, np.ones(len(ideal))])
    seen, _ = cv2.projectPoints(
        rays, np.zeros(3), np.zeros(3), calibration.intrinsics, np.array(calibration.distortion)
    )
    return np.asarray(seen, dtype=np.float64).reshape(-1, 2)


def _residuals(view: NDArray[np.uint8], result: Result) -> None:
    for corner, residual in zip(result.plate.corners_px, result.plate.residuals_px, strict=True):
        start = np.round(corner * 16).astype(int)
        end = np.round((corner + MAGNIFIED * residual) * 16).astype(int)
        cv2.line(view, tuple(start.tolist()), tuple(end.tolist()), RED, 2, cv2.LINE_AA, 4)
        cv2.circle(view, tuple(start.tolist()), 16 * 3, RED, 1, cv2.LINE_AA, 4)


def _panel(result: Result, height_px: int) -> NDArray[np.uint8]:
    panel = np.full((height_px, PANEL_PX, 3), 32, dtype=np.uint8)
    row = 24
    for line in _wrapped(f"red: residuals x {MAGNIFIED}; green: the plate every {GRID_STEP_MM} mm\n" + result.notes):
        if row > height_px - 10:
            break
        for cell, place in _cells(line) or [(line, 12)]:
            _write(panel, cell, (place, row))
        row += 16
    if result.tone is not None and row + 180 < height_px:
        _curve(panel[row + 10 : row + 160, 12:162], result)
        _write(panel, "0 ... light ... 1", (50, row + 174))
        _write(panel, "tone curve: the pixel's value by the light", (172, row + 24))
        _write(panel, "(green; grey: a straight one)", (172, row + 40))
    return panel


def _cells(line: str) -> list[tuple[str, int]]:
    """Returns the cells of a row of the table, and where they go; none for a sentence."""
    cells = re.split(" {2,}", line.strip())
    return list(zip(cells, COLUMNS_PX, strict=True)) if len(cells) == len(COLUMNS_PX) else []


def _write(panel: NDArray[np.uint8], text: str, place: tuple[int, int]) -> None:
    cv2.putText(panel, text, place, cv2.FONT_HERSHEY_SIMPLEX, FONT_SIZE, WHITE, 1, cv2.LINE_AA)


def _curve(box: NDArray[np.uint8], result: Result) -> None:
    """Draws pixel value over light, and the straight line that it should be."""
    if result.tone is None:
        return
    size = np.array([box.shape[1] - 1, box.shape[0] - 1])
    light, value = np.array(result.tone.curve.light), np.linspace(0.0, 1.0, KNOTS)
    for points, colour in (((value, value), GREY), ((light, value), GREEN)):
        path = np.column_stack([points[0], 1.0 - points[1]]) * size
        cv2.polylines(box, [np.round(path).astype(np.int32).reshape(-1, 1, 2)], False, colour, 1, cv2.LINE_AA)
    cv2.rectangle(box, (0, 0), tuple(size.tolist()), GREY, 1)


def _wrapped(text: str, *, width: int = 84) -> list[str]:
    """Returns lines short enough for the panel, in the characters that OpenCV can draw."""
    lines: list[str] = []
    for line in text.replace("±", "+-").replace("µ", "u").replace("°", " deg").splitlines():
        words, current = [line] if _cells(line) else line.split(" "), ""
        for word in words:
            if current and len(current) + len(word) > width:
                lines.append(current)
                current = "   "
            current += word + " "
        lines.append(current)
    return lines

"""Finds quadrilaterals in a whole frame that may be the mark: dark regions with four straight sides."""

import math
from collections.abc import Iterator

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Points = NDArray[np.complex128]
Frame = NDArray[np.uint8]

MOST_CANDIDATES = 6
SURROUND = 2.0  # side of the neighbourhood that a pixel is compared with, in largest marks
DARKER = 0.72  # a dark pixel is below this share of its neighbourhood's mean


def candidates(frame: Frame, *, side_px: tuple[float, float], aspect: float) -> list[Points]:
    """Gives rough corners (4,), px, clockwise as seen, of dark quadrilaterals of about the size wanted; the best first.

    `frame` (height, width) has 8-bit grey values.
    """
    longest = min(side_px[1] * max(1.0, aspect), math.hypot(*frame.shape))  # no mark in it is longer than its diagonal
    halve = side_px[0] * min(1.0, aspect) > 30
    small = _half(frame) if halve else frame
    scale = 2.0 if halve else 1.0
    area = (0.7 * side_px[0] ** 2 * aspect / scale**2, 1.4 * side_px[1] ** 2 * aspect / scale**2)
    for dark in _dark_regions(small, longest / scale):
        quads = _quads(dark, area)
        if quads:
            shift = 0.5 * (scale - 1.0) * (1.0 + 1.0j)
            return [(quad[:, 0] + 1j * quad[:, 1]) * scale + shift for quad in quads[:MOST_CANDIDATES]]
    return []


def _half(frame: Frame) -> Frame:
    height, width = frame.shape[0] // 2 * 2, frame.shape[1] // 2 * 2
    small = cv2.resize(frame[:height, :width], (width // 2, height // 2), interpolation=cv2.INTER_AREA)
    return np.asarray(small, dtype=np.uint8)


def _dark_regions(image: Frame, longest: float) -> Iterator[Frame]:
    """Yields binary images, one method after another.

    They show what is darker than the surroundings, then what is darker than Otsu's threshold.
    """
    side = int(SURROUND * longest) | 1
    mean = cv2.blur(image, (side, side))
    yield _as_frame(cv2.compare(image, cv2.convertScaleAbs(mean, alpha=DARKER), cv2.CMP_LT))
    yield _as_frame(cv2.threshold(image, 0, 255, cv2.THRESH_BINARY_INV | cv2.THRESH_OTSU)[1])
    yield _as_frame(cv2.compare(image, cv2.convertScaleAbs(mean, alpha=0.5), cv2.CMP_LT))


def _as_frame(image: object) -> Frame:
    return np.asarray(image, dtype=np.uint8)


def _quads(dark: Frame, area: tuple[float, float]) -> list[Floats]:
    contours, _ = cv2.findContours(dark, cv2.RETR_LIST, cv2.CHAIN_APPROX_SIMPLE)
    scored: list[tuple[float, Floats]] = []
    for contour in contours:
        if len(contour) < 4:
            continue
        hull = np.asarray(cv2.convexHull(contour), dtype=np.int32)
        size = cv2.contourArea(hull)
        if not area[0] <= size <= area[1]:
            continue
        quad, fill = _quad(hull, size)
        if fill > 0.8:
            scored.append((fill, quad))
    scored.sort(key=lambda pair: -pair[0])
    return [quad for _, quad in scored]


def _quad(hull: NDArray[np.int32], size: float) -> tuple[Floats, float]:
    """Returns four corners for a convex outline, and how well they fill: 1 for a perfect quadrilateral."""
    outline = cv2.approxPolyDP(hull, 0.05 * cv2.arcLength(hull, True), True)
    if len(outline) == 4:
        corners = outline.reshape(4, 2).astype(np.float64)
        share = cv2.contourArea(outline) / size
    else:
        corners = np.asarray(cv2.boxPoints(cv2.minAreaRect(hull)), dtype=np.float64)
        share = size / max(_area(corners), 1.0)
    return clockwise(corners), min(share, 1.0 / max(share, 1e-6))


def _area(corners: Floats) -> float:
    x, y = corners[:, 0], corners[:, 1]
    return 0.5 * abs(float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))))


def clockwise(corners: Floats) -> Floats:
    """Returns the same corners (4, 2), px, clockwise as seen (y down)."""
    x, y = corners[:, 0], corners[:, 1]
    turn = float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    return corners if turn > 0 else corners[::-1].copy()

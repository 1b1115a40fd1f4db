"""Tells which corner is which: read from the mark where it says so, else by continuity.

A quadrilateral that was found starts at any of its corners; a turn k means that the mark's corner 0 is its corner k.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking.mark import DOT_PLACE, NOTCH_PLACE, NOTCH_SIZE, TAG_BORDER, Mark, tag_bits, tag_table
from pi_agent.tracking.pixels import PixelReader

Floats = NDArray[np.float64]
Points = NDArray[np.complex128]

CLEAR = 0.35  # the white must stand out by this share of the light between dark and the brightest reading


def nearest_turn(corners: Points, expected: Points, *, step: int = 1) -> int:
    """Returns the turn that brings `corners` (4,), px, closest to the ones `expected` (4,), px.

    `step` is 2 for a rectangle.
    """
    turns = range(0, 4, step)
    return min(turns, key=lambda turn: float(np.sum(np.abs(np.roll(corners, -turn) - expected) ** 2)))


def first_turn(corners: Points, *, aspect: float) -> int:
    """Returns the turn at acquisition: corner 0 nearest to the image's top left.

    The first side of a rectangle is its own.

    For a rectangle the first side (its short one when aspect > 1) runs towards +x, as the paper's local axis.
    The `corners` (4,), px, lie clockwise as seen.
    """
    place = corners.tolist()
    if aspect != 1.0:
        even = abs(place[1] - place[0]) + abs(place[3] - place[2])
        odd = abs(place[2] - place[1]) + abs(place[0] - place[3])
        turns = (0, 2) if (even < odd) == (aspect > 1.0) else (1, 3)
        return max(turns, key=lambda turn: place[(turn + 1) % 4].real - place[turn].real)
    return min(range(4), key=lambda turn: place[turn].real + place[turn].imag)


class FeatureReader:
    """Reads the turn of a mark from its dot, notch or tag by light at a few places inside it."""

    def __init__(self, mark: Mark) -> None:
        self.mark = mark
        self._points = _feature_points(mark)
        self._bits = tag_bits(mark.tag_dictionary, mark.tag_id) if mark.feature == "tag" else None

    def turn(self, reader: PixelReader, corners: Points) -> int | None:
        """Returns the turn k, or None when the mark says nothing or cannot be read (covered, glare).

        The mark has `corners` (4,), px, in the frame that `reader` has open.
        """
        if self.mark.feature == "none":
            return None
        light = reader.bilinear(_place(corners, self._points))
        if self._bits is not None:
            return _tag_turn(light, self._bits)
        level = light.reshape(4, -1).mean(axis=1)
        order = np.argsort(level)
        low, high = level[order[2]], level[order[3]]
        return int(order[3]) if high - low > max(CLEAR * high, 4.0) else None


def _feature_points(mark: Mark) -> Floats:
    """Returns places inside a mark (points, 2), in sides from 0 to 1: for each of four turns, or the tag's cells."""
    if mark.feature == "tag":
        cells = len(tag_bits(mark.tag_dictionary, mark.tag_id))
        middle = (np.arange(cells) + TAG_BORDER + 0.5) / (cells + 2 * TAG_BORDER)
        return np.stack(np.meshgrid(middle, middle), axis=-1).reshape(-1, 2)
    spread = 0.04 * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
    if mark.feature == "dot":
        centre = np.array([DOT_PLACE, DOT_PLACE])
    else:
        centre, spread = np.array([NOTCH_PLACE, 0.55 * NOTCH_SIZE[1] - 0.5]), spread[:3] * 0.5
    points = centre + spread
    turns = []
    for _ in range(4):
        turns.append(points + 0.5)
        points = np.stack([-points[:, 1], points[:, 0]], axis=1)  # a quarter turn clockwise as seen
    return np.concatenate(turns)


def _place(corners: Points, points: Floats) -> NDArray[np.complex64]:
    """Returns image points of places inside the quadrilateral (bilinear: a mark is near enough to flat-on)."""
    u, v = points[:, 0], points[:, 1]
    top = corners[0] + u * (corners[1] - corners[0])
    bottom = corners[3] + u * (corners[2] - corners[3])
    return (top + v * (bottom - top)).astype(np.complex64)


def _tag_turn(light: NDArray[np.float32], bits: NDArray[np.uint8]) -> int | None:
    size = len(bits)
    low, high = float(light.min()), float(light.max())
    if high - low < max(CLEAR * high, 4.0):
        return None
    seen = (light.reshape(size, size) > 0.5 * (low + high)).astype(np.uint8)
    wrong = [int(np.count_nonzero(np.rot90(seen, turn) != bits)) for turn in range(4)]
    best = int(np.argmin(wrong))
    return best if wrong[best] <= max(size * size // 12, 1) else None


def detect_tag(frame: NDArray[np.uint8], mark: Mark) -> Points | None:
    """Finds the tag's corners (4,), px, by OpenCV's detector in the whole `frame` (h, w); None if there is no tag.

    They begin with the tag's own first one.

    The way out when no outline was found; slow, and the corners are to be refined.
    """
    table = tag_table(mark.tag_dictionary, mark.tag_id)
    found, ids, _ = cv2.aruco.ArucoDetector(table).detectMarkers(frame)
    numbers = [] if len(found) == 0 else np.ravel(ids).tolist()
    for quad, number in zip(found, numbers, strict=True):
        if int(number) == mark.tag_id:
            x, y = np.asarray(quad, dtype=np.float64).reshape(4, 2).T
            return np.asarray(x + 1j * y, dtype=np.complex128)
    return None


def notch_gap(mark: Mark) -> Floats | None:
    """Returns the part of each edge (4, 2), in sides from its start, that a notch takes away; None without one."""
    if mark.feature != "notch":
        return None
    half = 0.5 * NOTCH_SIZE[0] + 0.05
    middle = 0.5 + NOTCH_PLACE
    return np.array([[middle - half, middle + half], [2.0, 2.0], [2.0, 2.0], [2.0, 2.0]])

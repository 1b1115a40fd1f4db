"""Reads light from a frame at given places, without touching the rest of it."""

from functools import lru_cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.complex64]
Middles = NDArray[np.complex128]
Light = NDArray[np.float32]
Frame = NDArray[np.uint8]

REACH = 1  # pixels beyond a place that its light is read from


@lru_cache(maxsize=1)
def remap_is_exact() -> bool:
    """Returns true if cv2.remap reads at the very places: before OpenCV 5 it rounds them to 1/32 px."""
    ramp = np.arange(4, dtype=np.float32)[None].repeat(4, axis=0)
    x, y = np.full((1, 1), 1.01, dtype=np.float32), np.ones((1, 1), dtype=np.float32)
    return abs(float(_remapped(ramp, x, y)[0, 0]) - 1.01) < 1e-4


def _remapped(light: NDArray[Any], x: Light, y: Light) -> Light:
    """Returns the light at places x and y (n, m)."""
    return np.asarray(cv2.remap(light, x, y, cv2.INTER_LINEAR), dtype=np.float32)


@lru_cache(maxsize=8)
def _lattice(count: int, size: int) -> Light:
    """Returns the weights (3, count × size) of first place, way along and way across in those of all profiles."""
    along, across = np.meshgrid((np.arange(count) + 0.5) / count - 0.5, np.arange(size) / (size - 1), indexing="ij")
    return np.stack([np.ones(count * size), along.ravel(), across.ravel()]).astype(np.float32)


class PixelReader:
    """Light at points of one 8-bit frame after another; the tone curve is undone on the pixels that are read.

    `table`: light of each pixel value (256,), white = 255. Points are complex numbers x + i y.
    """

    def __init__(self, table: Light) -> None:
        self._table = table
        self._straight = bool(np.array_equal(table, np.arange(256)))
        self._frame: Frame = np.zeros((0, 0), dtype=np.uint8)
        self._flat: Frame = np.zeros(0, dtype=np.uint8)
        self._stride = 0
        self.width = 0
        self.height = 0

    def open(self, frame: Frame) -> None:
        """Takes the frame (height, width), whose rows may be padded, as the one to read from; nothing is copied."""
        self.height, self.width = frame.shape
        self._frame = frame
        if frame.flags.c_contiguous:
            self._stride, self._flat = self.width, frame.reshape(-1)
            return
        if frame.strides[1] != 1 or frame.strides[0] < self.width:
            frame = np.ascontiguousarray(frame)
        self._stride = frame.strides[0]
        size = (self.height - 1) * self._stride + self.width
        self._flat = np.lib.stride_tricks.as_strided(frame, shape=(size,), strides=(1,), writeable=False)

    def nearest(self, points: Points) -> Light:
        """Returns light, of 255, of the pixels nearest to `points` (…,), px, in their shape.

        Points outside read the border.
        """
        column = np.clip(points.real + 0.5, 0, self.width - 1).astype(np.intp)
        row = np.clip(points.imag + 0.5, 0, self.height - 1).astype(np.intp)
        return self._table.take(self._flat.take(row * self._stride + column))

    def profiles(
        self, first: Middles, along: Middles, across: Middles, *, count: int, size: int
    ) -> tuple[Light, Light]:
        """Returns light between the pixels along `count` profiles of `size` places on each edge: (4, count, size).

        The box around all of them is turned to light as a whole, and read by OpenCV in one call.

        Args:
            first: (4,) the innermost place of the middle profile, px.
            along: (4,) the way along the edge, from the first half profile to the last one, px.
            across: (4,) the way across it, from the innermost place to the outermost, px.
            count: the number of profiles of an edge.
            size: the number of places of a profile.

        Returns:
            The light (4, count, size), and the places themselves (8, count × size): x and y of the first edge, of the
            second, … but for whole pixels.
        """
        half, foot, way = (0.5 * along).tolist(), first.tolist(), across.tolist()
        ends = [z + w for z, d, h in zip(foot, way, half, strict=True) for z in (z, z + d) for w in (h, -h)]
        x, y = [end.real for end in ends], [end.imag for end in ends]
        left, top, right, bottom = int(min(x)), int(min(y)), int(max(x)) + REACH, int(max(y)) + REACH
        inside = min(x) >= 0 and min(y) >= 0 and right < self.width and bottom < self.height
        at_once = inside and remap_is_exact()
        origin = complex(left, top) if at_once else 0j
        spans = np.array([first - origin, along, across]).view(np.float64).reshape(3, 8).T.astype(np.float32)
        places = spans @ _lattice(count, size)
        if not at_once:
            points = (places[0::2] + 1j * places[1::2]).astype(np.complex64, copy=False)
            return self.bilinear(points.reshape(4, count, size)), places
        box = self._frame[top : bottom + 1, left : right + 1]
        light = box.astype(np.float32) if self._straight else cv2.LUT(box, self._table)
        return _remapped(light, places[0::2], places[1::2]).reshape(4, count, size), places

    def bilinear(self, points: Points) -> Light:
        """Returns light, of 255, between the pixels at `points` (…,), px, in their shape.

        Points outside read the border.
        """
        x, y = points.real, points.imag
        if x.min() < 0 or y.min() < 0 or x.max() >= self.width - 1 or y.max() >= self.height - 1:
            x, y = np.clip(x, 0.0, self.width - 1.001), np.clip(y, 0.0, self.height - 1.001)
        column, row = x.astype(np.int32), y.astype(np.int32)
        right, down = (x - column).astype(np.float32), (y - row).astype(np.float32)
        index = row.astype(np.intp)
        index *= self._stride
        index += column
        corners = np.empty((4, *index.shape), dtype=np.intp)
        corners[0] = index
        np.add(index, 1, out=corners[1])
        np.add(index, self._stride, out=corners[2])
        np.add(index, self._stride + 1, out=corners[3])
        light = self._table.take(self._flat.take(corners))
        upper = light[0] + right * (light[1] - light[0])
        lower = light[2] + right * (light[3] - light[2])
        lower -= upper
        lower *= down
        upper += lower
        return upper

"""Reads light from a frame at given places, without touching the rest of it."""

from functools import lru_cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.complex64]
Light = NDArray[np.float32]
Frame = NDArray[np.uint8]

REACH = 1  # pixels beyond a place that its light is read from


@lru_cache(maxsize=1)
def remap_is_exact() -> bool:
    """Whether cv2.remap reads at the very places: before OpenCV 5 it rounds them to 1/32 px."""
    ramp = np.arange(4, dtype=np.float32)[None].repeat(4, axis=0)
    place = np.array([[[1.01, 1.0]]], dtype=np.float32)
    return abs(float(_remapped(ramp, place)[0, 0]) - 1.01) < 1e-4


def _remapped(light: NDArray[Any], places: Light) -> Light:
    """Light at places (n, m, 2), x before y."""
    # OpenCV's types do not know that there is no second map when the first one holds x and y.
    seen = cv2.remap(light, places, None, cv2.INTER_LINEAR)  # pyright: ignore[reportCallIssue, reportArgumentType]
    return np.asarray(seen, dtype=np.float32)


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
        """Light of the nearest pixels; points outside read the border."""
        column = np.clip(points.real + 0.5, 0, self.width - 1).astype(np.intp)
        row = np.clip(points.imag + 0.5, 0, self.height - 1).astype(np.intp)
        return self._table.take(self._flat.take(row * self._stride + column))

    def profiles(self, base: NDArray[np.complex128], across: NDArray[np.complex128]) -> Light:
        """Light between the pixels along profiles: at `base` (4, n) + `across` (4, m), as (4, n, m).

        The box around all of them is turned to light as a whole, and read by OpenCV in one call.
        """
        ends = (base[:, :: base.shape[1] - 1, None] + across[:, None, :: across.shape[1] - 1]).ravel().tolist()
        x, y = [end.real for end in ends], [end.imag for end in ends]
        left, top, right, bottom = int(min(x)), int(min(y)), int(max(x)) + REACH, int(max(y)) + REACH
        inside = min(x) >= 0 and min(y) >= 0 and right < self.width and bottom < self.height
        origin = complex(left, top) if inside else 0j
        points = (base - origin).astype(np.complex64)[:, :, None] + across.astype(np.complex64)[:, None, :]
        if not inside or not remap_is_exact():
            return self.bilinear(points + np.complex64(origin))
        box = self._frame[top : bottom + 1, left : right + 1]
        light = box.astype(np.float32) if self._straight else cv2.LUT(box, self._table)
        flat = points.view(np.float32).reshape(-1, points.shape[2], 2)
        return _remapped(light, flat).reshape(points.shape)

    def bilinear(self, points: Points) -> Light:
        """Light between the pixels; points outside read the border."""
        x, y = points.real, points.imag
        if x.min() < 0 or y.min() < 0 or x.max() >= self.width - 1 or y.max() >= self.height - 1:
            x, y = np.clip(x, 0.0, self.width - 1.001), np.clip(y, 0.0, self.height - 1.001)
        column, row = x.astype(np.int32), y.astype(np.int32)
        right, down = (x - column).astype(np.float32), (y - row).astype(np.float32)
        place = row.astype(np.intp)
        place *= self._stride
        place += column
        corners = np.empty((4, *place.shape), dtype=np.intp)
        corners[0] = place
        np.add(place, 1, out=corners[1])
        np.add(place, self._stride, out=corners[2])
        np.add(place, self._stride + 1, out=corners[3])
        light = self._table.take(self._flat.take(corners))
        upper = light[0] + right * (light[1] - light[0])
        lower = light[2] + right * (light[3] - light[2])
        lower -= upper
        lower *= down
        upper += lower
        return upper

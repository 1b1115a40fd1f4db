"""Reads light from a frame at given places, without touching the rest of it."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Frame = NDArray[np.uint8]


class PixelReader:
    """Light at points of one 8-bit frame after another; the tone curve is undone on the pixels that are read.

    `table`: light of each pixel value (256,), white = 255.
    """

    def __init__(self, table: NDArray[np.float32]) -> None:
        self._table = table
        self._flat: Frame = np.zeros(0, dtype=np.uint8)
        self._stride = 0
        self.width = 0
        self.height = 0

    def open(self, frame: Frame) -> None:
        """Takes the frame (height, width), whose rows may be padded, as the one to read from; nothing is copied."""
        self.height, self.width = frame.shape
        if frame.strides[1] != 1 or frame.strides[0] <= 0:
            frame = np.ascontiguousarray(frame)
        self._stride = frame.strides[0]
        size = (self.height - 1) * self._stride + self.width
        self._flat = np.lib.stride_tricks.as_strided(frame, shape=(size,), strides=(1,), writeable=False)

    def nearest(self, x: Floats, y: Floats) -> NDArray[np.float32]:
        """Light of the nearest pixels; points outside read the border."""
        column = np.clip(np.rint(x), 0, self.width - 1).astype(np.intp)
        row = np.clip(np.rint(y), 0, self.height - 1).astype(np.intp)
        return self._table.take(self._flat.take(row * self._stride + column))

    def bilinear(self, x: Floats, y: Floats) -> Floats:
        """Light between the pixels; points outside read the border."""
        x = np.clip(x, 0.0, self.width - 1.001)
        y = np.clip(y, 0.0, self.height - 1.001)
        column, row = x.astype(np.intp), y.astype(np.intp)
        right, down = x - column, y - row
        place = row * self._stride + column
        top_left, top_right = self._light(place), self._light(place + 1)
        place += self._stride
        bottom_left, bottom_right = self._light(place), self._light(place + 1)
        top = top_left + right * (top_right - top_left)
        return top + down * (bottom_left + right * (bottom_right - bottom_left) - top)

    def _light(self, place: NDArray[np.intp]) -> NDArray[np.float32]:
        return self._table.take(self._flat.take(place))

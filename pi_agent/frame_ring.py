"""The last frames, kept in memory that is taken once."""

from __future__ import annotations

import threading
from dataclasses import dataclass

import numpy as np

from pi_agent.cameras import Image
from shared.messages import MarkerCorners

LARGEST_BYTES = 96 * 2**20
"""A second and a half of 600 × 600 at 180 Hz; a Pi with 1 GB spares as much."""


@dataclass(frozen=True)
class KeptFrame:
    """A copy of a frame with the block's corners in it."""

    image: Image
    corners: MarkerCorners

    @property
    def capture_ns(self) -> int:
        """The moment of its capture."""
        return self.corners.capture_ns


class FrameRing:
    """Keeps the last `seconds` of frames (fewer if they would not fit into `LARGEST_BYTES`). Safe between threads."""

    def __init__(self, *, height_px: int, width_px: int, rate_hz: float, seconds: float = 2.0) -> None:
        fits = LARGEST_BYTES // (height_px * width_px)
        self.capacity = int(max(min(np.ceil(rate_hz * seconds), fits), 2))
        self._images = np.empty((self.capacity, height_px, width_px), dtype=np.uint8)
        self._corners: list[MarkerCorners | None] = [None] * self.capacity
        self._count = 0
        self._lock = threading.Lock()

    def put(self, image: Image, corners: MarkerCorners) -> None:
        """Copies the frame `image` (height, width), 8-bit grey values, over the oldest one."""
        with self._lock:
            slot = self._count % self.capacity
            self._images[slot] = image
            self._corners[slot] = corners
            self._count += 1

    def latest(self) -> KeptFrame | None:
        """Returns a copy of the newest frame."""
        with self._lock:
            return self._copy(self._count - 1) if self._count else None

    def next_after(self, stamp_ns: int) -> KeptFrame | None:
        """Returns a copy of the oldest kept frame that was captured after `stamp_ns`."""
        with self._lock:
            for number in range(max(self._count - self.capacity, 0), self._count):
                corners = self._corners[number % self.capacity]
                if corners is not None and corners.capture_ns > stamp_ns:
                    return self._copy(number)
        return None

    def stamps(self) -> list[int]:
        """Returns the capture times of the kept frames, oldest first."""
        with self._lock:
            first = max(self._count - self.capacity, 0)
            kept = (self._corners[number % self.capacity] for number in range(first, self._count))
            return [corners.capture_ns for corners in kept if corners is not None]

    def _copy(self, number: int) -> KeptFrame | None:
        corners = self._corners[number % self.capacity]
        return None if corners is None else KeptFrame(self._images[number % self.capacity].copy(), corners)

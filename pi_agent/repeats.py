"""Tells a frame that was there before: a camera that is frozen, or a driver that hands its buffers out again in turn.

No sensor gives the same picture twice, because its noise is drawn anew. A camera that has none says so (`noiseless`);
only its stamps tell then, and a drawn picture's stamp is that of the scene that it was drawn from.
"""

from __future__ import annotations

from collections import deque

from pi_agent.cameras import CameraInfo, Frame

BUFFERS = 64
"""The pictures among which one is sought again: twice as many as V4L2 lets a driver have (VIDEO_MAX_FRAME is 32)."""

EVERY_ROW = 8
"""Every eighth row is compared: 45 000 pixels of noise never agree, and their hash takes some twenty microseconds
(`python -m timeit -s "import numpy as np; a = np.zeros((600, 600), np.uint8)" "hash(a[::8].tobytes())"`)."""


class Repeats:
    """Compares each frame with those before it."""

    def __init__(self, info: CameraInfo) -> None:
        self._noiseless = info.noiseless
        self._pictures: deque[int] = deque(maxlen=BUFFERS)
        self._capture_ns: int | None = None

    def see(self, frame: Frame) -> bool:
        """Takes a frame; true if it was there before."""
        before_ns, self._capture_ns = self._capture_ns, frame.capture_ns
        stamped_again = before_ns is not None and frame.capture_ns <= before_ns
        return stamped_again or (not self._noiseless and self._seen_again(frame))

    def _seen_again(self, frame: Frame) -> bool:
        picture = hash(frame.image[::EVERY_ROW].tobytes())
        again = picture in self._pictures
        self._pictures.append(picture)
        return again

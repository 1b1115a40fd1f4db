"""Tells a frame that was there before: a camera that is frozen, or a driver that hands its buffers out again in turn.

No sensor gives the same picture twice, because its noise is drawn anew. A camera that has none says so (`noiseless`);
only its stamps tell then, and a drawn picture's stamp is that of the scene that it was drawn from.
"""

from __future__ import annotations

from pi_agent.cameras import CameraInfo, Frame
from shared.recent import Recent

EVERY_ROW = 8
"""Every eighth row is compared: 45 000 pixels of noise never agree, and their hash takes some twenty microseconds
(`python -m timeit -s "import numpy as np; a = np.zeros((600, 600), np.uint8)" "hash(a[::8].tobytes())"`)."""


class Repeats:
    """Compares each frame with those before it."""

    def __init__(self, info: CameraInfo) -> None:
        self._noiseless = info.noiseless
        self._pictures = Recent()
        self._capture_ns: int | None = None

    def see(self, frame: Frame) -> bool:
        """Takes a frame; true if it was there before."""
        before_ns, self._capture_ns = self._capture_ns, frame.capture_ns
        stamped_again = before_ns is not None and frame.capture_ns <= before_ns
        seen_again = not self._noiseless and self._pictures.has(frame.image[::EVERY_ROW].tobytes())
        return stamped_again or seen_again

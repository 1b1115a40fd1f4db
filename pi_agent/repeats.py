"""Tells a frame that is the one before again: a camera, or the driver's buffer, that is frozen.

No sensor gives the same picture twice, because its noise is drawn anew. A camera that has none says so (`noiseless`);
only its stamps tell then, and a drawn picture's stamp is that of the scene that it was drawn from.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pi_agent.cameras import CameraInfo, Frame

EVERY_ROW = 8
"""Every eighth row is compared: 45 000 pixels of noise never agree, and a copy of them takes some ten microseconds
(`python -m timeit -s "import numpy as np; a = np.zeros((600, 600), np.uint8)" "a[::8].copy()"`)."""


class Repeats:
    """Compares each frame with the one before it."""

    def __init__(self, info: CameraInfo) -> None:
        self._noiseless = info.noiseless
        self._rows: NDArray[np.uint8] | None = None
        self._capture_ns: int | None = None

    def see(self, frame: Frame) -> bool:
        """Takes a frame; true if it is the one before again."""
        before_ns, self._capture_ns = self._capture_ns, frame.capture_ns
        stamped_again = before_ns is not None and frame.capture_ns <= before_ns
        return stamped_again or (not self._noiseless and self._same_picture(frame))

    def _same_picture(self, frame: Frame) -> bool:
        before, self._rows = self._rows, frame.image[::EVERY_ROW].copy()
        return before is not None and np.array_equal(before, self._rows)

"""Tells when each row of a frame was exposed."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True)
class Shutter:
    """The exposure of a frame's rows.

    The middle of row y's exposure is `capture + row0_dt_ns + y × line_ns`. On the Pi, where the capture time is the
    start of readout, `row0_dt_ns` is minus half the exposure plus the cropped rows' time; a global shutter has
    `line_ns` 0.
    """

    line_ns: float = 0.0
    exposure_ns: int = 0
    row0_dt_ns: float = 0.0

    def dt_s(self, row: ArrayLike) -> NDArray[np.float64]:
        """Returns mid-exposure (…,), s, of the given rows (…,), px, fractions allowed, after the capture time."""
        return (self.row0_dt_ns + np.asarray(row, dtype=np.float64) * self.line_ns) * 1e-9

    @property
    def line_s(self) -> float:
        """Time from one row to the next, in seconds."""
        return self.line_ns * 1e-9

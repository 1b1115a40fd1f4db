"""What motion does to a picture: the smear of the exposure, and the bend by a rolling shutter."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Points = NDArray[np.complex128]


@dataclass(frozen=True)
class Smear:
    """The way of a moving mark within the exposure: that of its centre (px), and its turn (rad) about it."""

    centre: complex
    path_px: complex
    turn_rad: float

    def across(self, points: Points, tangent: Points) -> Floats:
        """How far the edges with these tangents (4, 1) move across themselves at points (4, n), in px."""
        return np.abs((np.conj(tangent) * (self.path_px + 1j * self.turn_rad * (points - self.centre))).imag)


@dataclass(frozen=True)
class Sweep:
    """How a rolling shutter bends a turning mark: its centre, velocity and yaw rate, time per row (px, rad, s).

    Only what is quadratic in the rows matters here; the linear part stays in the corners, which are reported where and
    when their own rows saw them. An error of the velocity is of no account for the same reason.
    """

    centre: complex
    velocity_px_s: complex
    yaw_rate_rad_s: float
    line_s: float

    def shift(self, points: Points) -> Points:
        """How far the points have moved, by the time at which their rows are exposed, since the centre's row was."""
        velocity = self.velocity_px_s + 1j * self.yaw_rate_rad_s * (points - self.centre)
        return velocity * ((points.imag - self.centre.imag) * self.line_s)

    def as_seen(self, corners: Points) -> Points:
        """Corners at their own rows' times from corners at the time of the centre's row."""
        seen = corners + self.shift(corners)
        return corners + self.shift(seen)

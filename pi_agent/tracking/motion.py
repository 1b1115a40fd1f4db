"""Where the mark will be in the next frame, from the last two. Corners (4,) are complex: x + i y, px."""

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.complex128]

LONGEST_GAP_S = 0.25  # after a longer dropout the last velocity says nothing


class Motion:
    """Constant velocity and yaw rate, from the corners of the last two frames in which the mark was found."""

    def __init__(self) -> None:
        self.corners: Points | None = None
        self.centre = 0j
        self.time_s = 0.0
        self.velocity_px_s = 0j
        self.yaw_rate_rad_s = 0.0
        self.has_velocity = False

    def update(self, corners: Points, time_s: float) -> None:
        """Takes the corners seen at a time."""
        centre = complex(corners.sum()) / 4
        if self.corners is not None:
            gap = time_s - self.time_s
            near = self.has_velocity = 0.0 < gap < LONGEST_GAP_S
            self.velocity_px_s = (centre - self.centre) / gap if near else 0j
            turn = float(np.angle(np.vdot(self.corners - self.centre, corners - centre)))
            self.yaw_rate_rad_s = turn / gap if near else 0.0
        self.corners, self.centre, self.time_s = corners, centre, time_s

    def predict(self, time_s: float) -> Points | None:
        """The corners expected at a time; None before the first sight."""
        if self.corners is None:
            return None
        gap = time_s - self.time_s
        if not 0.0 < gap < LONGEST_GAP_S:
            return self.corners
        turn = np.exp(1j * self.yaw_rate_rad_s * gap)
        return (self.corners - self.centre) * turn + (self.centre + self.velocity_px_s * gap)

    def velocity_at(self, points: Points) -> Points:
        """Velocity of the mark's points at the image points given, px/s."""
        return self.velocity_px_s + 1j * self.yaw_rate_rad_s * (points - self.centre)

"""Where the mark will be in the next frame, from the last two."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

LONGEST_GAP_S = 0.25  # after a longer dropout the last velocity says nothing


class Motion:
    """Constant velocity and yaw rate, from the corners of the last two frames in which the mark was found."""

    def __init__(self) -> None:
        self.corners: Floats | None = None
        self.time_s = 0.0
        self.velocity_px_s: Floats = np.zeros(2)
        self.yaw_rate_rad_s = 0.0

    def update(self, corners: Floats, time_s: float) -> None:
        """Takes the corners (4, 2) seen at a time."""
        if self.corners is not None:
            gap = time_s - self.time_s
            near = 0.0 < gap < LONGEST_GAP_S
            self.velocity_px_s = (corners.mean(axis=0) - self.corners.mean(axis=0)) / gap if near else np.zeros(2)
            self.yaw_rate_rad_s = turned(self.corners, corners) / gap if near else 0.0
        self.corners, self.time_s = corners, time_s

    def predict(self, time_s: float) -> Floats | None:
        """The corners (4, 2) expected at a time; None before the first sight."""
        if self.corners is None:
            return None
        gap = time_s - self.time_s
        if not 0.0 < gap < LONGEST_GAP_S:
            return self.corners
        centre = self.corners.mean(axis=0)
        angle = self.yaw_rate_rad_s * gap
        cos, sin = np.cos(angle), np.sin(angle)
        return (self.corners - centre) @ np.array([[cos, sin], [-sin, cos]]) + centre + self.velocity_px_s * gap

    def corner_velocity(self) -> Floats:
        """Velocity (4, 2) of the four corners, px/s."""
        if self.corners is None:
            return np.zeros((4, 2))
        arm = self.corners - self.corners.mean(axis=0)
        return self.velocity_px_s + self.yaw_rate_rad_s * np.stack([-arm[:, 1], arm[:, 0]], axis=1)


def turned(before: Floats, after: Floats) -> float:
    """The angle (rad, x towards y) by which the corners turned."""
    a = before - before.mean(axis=0)
    b = after - after.mean(axis=0)
    return float(np.arctan2(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a * b)))

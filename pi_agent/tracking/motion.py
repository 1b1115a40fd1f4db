"""Where the mark will be in the next frame, from the last ones. Corners (4,) are complex: x + i y, px."""

from cmath import exp, phase
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.complex128]
Four = list[complex]

LONGEST_GAP_S = 0.25  # after a longer dropout the last velocity says nothing
LEAST_GAIN_PX = 0.4  # a change of the step from frame to frame that is expected to go on: less may be noise


@dataclass(frozen=True)
class Way:
    """How the mark moves: its centre's velocity and its yaw rate."""

    velocity_px_s: complex = 0j
    yaw_rate_rad_s: float = 0.0


STILL = Way()


def centre_of(corners: Points) -> complex:
    """The mean of corners (4,): as plain numbers, in a third of the time of an array's."""
    a, b, c, d = corners.tolist()
    return (a + b + c + d) / 4


def unsheared(corners: Points, *, way: Way, line_s: float) -> Four:
    """Corners at the time of their centre's row, from corners at their own rows' times."""
    seen: Four = corners.tolist()
    if line_s == 0.0:
        return seen
    centre = sum(seen) / 4
    # From frame to frame a corner's row moves along, and its time with it.
    velocity = way.velocity_px_s / (1.0 + line_s * way.velocity_px_s.imag)
    turning = 1j * way.yaw_rate_rad_s
    return [z - (velocity + turning * (z - centre)) * ((z - centre).imag * line_s) for z in seen]


class Motion:
    """Velocity, its change and yaw rate, from the corners of the last frames in which the mark was found."""

    def __init__(self) -> None:
        self.corners: Points | None = None
        self.centre = 0j
        self.time_s = 0.0
        self.way = STILL
        self.has_velocity = False
        self._gain_px_s2 = 0j

    def update(self, corners: Points, time_s: float) -> None:
        """Takes the corners seen at a time."""
        if self.corners is not None:
            had_velocity, before = self.has_velocity, self.way
            self.has_velocity = self.gains(time_s)
            self.way = self.way_to(corners, time_s)
            gap = time_s - self.time_s
            change = self.way.velocity_px_s - before.velocity_px_s
            lasting = had_velocity and self.has_velocity and abs(change) * gap > LEAST_GAIN_PX
            self._gain_px_s2 = change / gap if lasting else 0j
        self.corners, self.centre, self.time_s = corners, centre_of(corners), time_s

    def gains(self, time_s: float) -> bool:
        """Whether corners at this time tell of a velocity: the last ones are not too long ago."""
        return self.corners is not None and 0.0 < time_s - self.time_s < LONGEST_GAP_S

    def speed_px_s(self, corners: Points, time_s: float) -> float:
        """The centre's speed from the last corners to these."""
        return abs(centre_of(corners) - self.centre) / (time_s - self.time_s) if self.gains(time_s) else 0.0

    def way_to(self, corners: Points, time_s: float) -> Way:
        """The way from the last corners to these."""
        last, gap = self.corners, time_s - self.time_s
        if last is None or not 0.0 < gap < LONGEST_GAP_S:
            return STILL
        centre = centre_of(corners)
        turn = phase(complex(np.vdot(last - self.centre, corners - centre)))
        return Way((centre - self.centre) / gap, turn / gap)

    def predict(self, time_s: float) -> Points | None:
        """The corners expected at a time; None before the first sight."""
        if self.corners is None:
            return None
        gap = time_s - self.time_s
        if not 0.0 < gap < LONGEST_GAP_S:
            return self.corners
        turn = exp(1j * self.way.yaw_rate_rad_s * gap)
        step = (self.way.velocity_px_s + self._gain_px_s2 * gap) * gap
        return (self.corners - self.centre) * turn + (self.centre + step)

"""Predicts the mark's place in the next frame from the last ones. Corners (4,) are complex: x + i y, px."""

from cmath import exp, phase
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.complex128]
Four = list[complex]

LONGEST_GAP_S = 0.25  # after a longer dropout the last velocity says nothing
UNSTEADY = 4.0  # possible error of the speed, in changes of what is gained from frame to frame
LEAST_STEP_PX = 0.03  # a mark that lay still and has gone so far has begun to slide
MOST_GAIN_PX_S2 = 60_000.0  # no block gains more: 10 m/s² at 6 px a millimetre
LEAST_GAIN_PX = 0.4  # change of the step from frame to frame that is expected to go on: less may be noise


@dataclass(frozen=True)
class Way:
    """The motion of the mark: its centre's velocity and its yaw rate.

    `gained_px_s` and `turned_rad_s`: the parts of them that were gained since the middle of the way that told them;
    `unsteady_px_s`: by how much the velocity may be another one, if it is not gained as steadily as before.
    """

    velocity_px_s: complex = 0j
    yaw_rate_rad_s: float = 0.0
    gained_px_s: complex = 0j
    turned_rad_s: float = 0.0
    unsteady_px_s: float = 0.0


STILL = Way()


def centre_of(corners: Points) -> complex:
    """Returns the mean of corners (4,): as plain numbers, in a third of the time of an array's."""
    a, b, c, d = corners.tolist()
    return (a + b + c + d) / 4


def unsheared(corners: Points, *, way: Way, line_s: float) -> Four:
    """Returns corners, px, at the time of their centre's row, from `corners` (4,), px, at their own rows' times."""
    seen: Four = corners.tolist()
    if line_s == 0.0:
        return seen
    centre = sum(seen) / 4
    # From frame to frame a corner's row moves along, and its time with it.
    velocity = way.velocity_px_s / (1.0 + line_s * way.velocity_px_s.imag)
    turning = 1j * way.yaw_rate_rad_s
    return [z - (velocity + turning * (z - centre)) * ((z - centre).imag * line_s) for z in seen]


class Motion:
    """Velocity, its change and yaw rate, from the corners of the last frames in which the mark was found.

    From one frame to the next only the mean velocity is seen, which is that of half a frame ago; what is gained from
    one mean to the next tells the present one.
    """

    def __init__(self) -> None:
        self.corners: Points | None = None
        self.centre = 0j
        self.time_s = 0.0
        self.way = STILL
        self.has_velocity = False
        self._mean_px_s, self._mean_yaw_rad_s = 0j, 0.0
        self._gap_s = 0.0
        self._gain_px_s2 = 0j
        self._asked: tuple[Points, float, Way] | None = None  # the last answer: a frame asks several times

    def update(self, corners: Points, time_s: float) -> None:
        """Takes the `corners` (4,), px, seen at a time."""
        if self.corners is not None:
            seen, gap_s = self.gains(time_s), time_s - self.time_s
            way = self.way_to(corners, time_s)
            mean = way.velocity_px_s - way.gained_px_s
            change = mean - self._mean_px_s
            lasting = self.has_velocity and seen and abs(change) * gap_s > LEAST_GAIN_PX
            self._gain_px_s2 = change / gap_s if lasting else 0j
            self.way, self.has_velocity, self._gap_s = way, seen, gap_s
            self._mean_px_s, self._mean_yaw_rad_s = mean, way.yaw_rate_rad_s - way.turned_rad_s
        self.corners, self.centre, self.time_s = corners, centre_of(corners), time_s
        self._asked = None

    def gains(self, time_s: float) -> bool:
        """Returns true if corners at this time tell of a velocity: the last ones are not too long ago."""
        return self.corners is not None and 0.0 < time_s - self.time_s < LONGEST_GAP_S

    def way_to(self, corners: Points, time_s: float) -> Way:
        """Returns the motion of the mark at these `corners` (4,), px, by the way from the last ones and that before."""
        asked = self._asked
        if asked is None or asked[0] is not corners or asked[1] != time_s:
            asked = self._asked = corners, time_s, self._way_to(corners, time_s)
        return asked[2]

    def _way_to(self, corners: Points, time_s: float) -> Way:
        last, gap_s = self.corners, time_s - self.time_s
        if last is None or not 0.0 < gap_s < LONGEST_GAP_S:
            return STILL
        centre = centre_of(corners)
        velocity = (centre - self.centre) / gap_s
        yaw_rate = phase(complex(np.vdot(last - self.centre, corners - centre))) / gap_s
        if not self.has_velocity:
            return Way(velocity, yaw_rate, unsteady_px_s=0.5 * abs(velocity))
        # The speed changes from the middle of one way to that of the next: here is what falls on the second half of
        # this one. A mark that is stopped on the way has lost its speed, but does not turn back.
        share = gap_s / (gap_s + self._gap_s)
        gained = share * (velocity - self._mean_px_s)
        gained *= min(1.0, abs(velocity) / max(abs(gained), 1e-9))
        turned = share * (yaw_rate - self._mean_yaw_rad_s)
        turned = min(max(turned, -abs(yaw_rate)), abs(yaw_rate))
        unsteady = UNSTEADY * abs(gained - self.way.gained_px_s)
        step_px = abs(velocity) * gap_s
        if step_px > LEAST_STEP_PX and abs(self._mean_px_s) * gap_s < 0.1 * step_px:
            # It may have begun when most of the frame was read, and have its speed since then.
            unsteady = max(unsteady, sqrt(2.0 * MOST_GAIN_PX_S2 * step_px) - abs(velocity + gained))
        return Way(velocity + gained, yaw_rate + turned, gained, turned, unsteady)

    def expected_way(self, time_s: float) -> Way:
        """Returns the motion of the mark that is expected at a time."""
        if not self.gains(time_s):
            return self.way
        return replace(self.way, velocity_px_s=self.way.velocity_px_s + self._gain_px_s2 * (time_s - self.time_s))

    def predict(self, time_s: float) -> Points | None:
        """Returns the corners (4,), px, expected at a time; None before the acquisition."""
        if self.corners is None:
            return None
        gap = time_s - self.time_s
        if not 0.0 < gap < LONGEST_GAP_S:
            return self.corners
        turn = exp(1j * self.way.yaw_rate_rad_s * gap)
        step = (self._mean_px_s + self._gain_px_s2 * gap) * gap
        return (self.corners - self.centre) * turn + (self.centre + step)

"""A mark does not change its shape: what differs from the last frames was done to the picture.

A finger, a highlight or the edge of a shadow can move one edge of the outline without breaking it. While the mark stays
where it is, light and lens give every frame the same outline, and even a small departure tells. Once it has moved by
some pixels the lens and the plate's texture change the outline as well: more is allowed there, and it is learned anew.
"""

from math import acos, sqrt

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking.motion import Way, centre_of, unsheared
from pi_agent.tracking.validation_gate import PERSPECTIVE

Points = NDArray[np.complex128]
Compared = tuple[Points, Points, float]
Seen = tuple[Points, Way]

NEAR_PX = 3.0  # within this distance a lens changes an outline by less than is told here
NEAR_ON_TEXTURE_PX = 0.15  # the same for the plate's texture beside bare tape
LEAST_SHARE = 0.1  # share of the newest frame in the outline that is remembered
SYSTEMATIC_PX = 0.03  # departure that sampling and texture may cause
LENS = 0.004  # departure by a lens, a camera that looks askew or an unsteady speed, in shares of the distance
FARTHEST_PX = 40.0  # beyond this distance from the last frame the outline is another one
NOISE_PX = 1.2  # deviation of a corner's coordinate by pixel noise, times the contrast (of 255)
SHARP_PX = 0.9  # blur of the lens for which that holds; out of focus it grows with the root of the blur
DEVIATIONS = 4.0


class RestingShape:
    """The mark's outline, learned from frame to frame; well known while it stays within `near_px` of its place.

    `line_s`: time from row to row, by which a mark that moves is seen as another shape.
    """

    def __init__(self, *, near_px: float, line_s: float) -> None:
        self._near_px, self._line_s = near_px, line_s
        self._place: Points | None = None
        self._sigma_px = 0.0
        self._frames = 0
        self._compared: tuple[Seen, Compared | None] | None = None

    def departed(self, corners: Points, *, way: Way) -> Compared | None:
        """Returns arms (4,) of the outline about its centre, those of corners turned onto it, and the way between (px).

        None before an outline was learned, or far away from it.
        """
        place = self._place
        if place is None:
            return None
        if self._compared is not None and self._compared[0][0] is corners and self._compared[0][1] == way:
            return self._compared[1]
        at_once = self._at_once(corners, way)
        own, centre = centre_of(place), centre_of(at_once)
        arms, seen = place - own, at_once - centre
        turn = complex(np.vdot(seen, arms))
        turn /= max(abs(turn), 1e-9)
        way_px = abs(centre - own) + abs(turn - 1.0) * max(np.abs(arms).tolist())
        compared = None if way_px > FARTHEST_PX else (arms, seen * turn, way_px)
        self._compared = (corners, way), compared
        return compared

    def limit_px(self, *, way_px: float, noise_px: float, sigma_px: float, slack_px: float) -> float:
        """Returns the largest departure that pixel noise and sampling explain, and further away grain and lens.

        `noise_px`: that of a corner (see the function); `slack_px`: what the rolling shutter may make of the outline by
        a speed that is not steady.
        """
        noise = noise_px * float(np.sqrt(1.0 + 1.0 / max(self._frames, 1)))
        limit = SYSTEMATIC_PX + DEVIATIONS * noise + slack_px
        if way_px < self._near_px:
            return limit
        return max(limit, DEVIATIONS * float(np.hypot(sigma_px, self._sigma_px))) + LENS * way_px

    def learn(self, corners: Points, *, way: Way, sigma_px: float) -> None:
        """Takes the `corners` (4,), px, of a frame that was believed, and their sigma."""
        near = self.departed(corners, way=way)
        self._compared = None
        if near is None or near[2] > self._near_px or self._place is None:
            self._place, self._frames, self._sigma_px = self._at_once(corners, way), 1, sigma_px
            return
        self._frames += 1
        share = max(1.0 / self._frames, LEAST_SHARE)
        self._place = self._place + share * (near[1] - near[0])

    def _at_once(self, corners: Points, way: Way) -> Points:
        """Returns the corners at the time of one row."""
        return corners if self._line_s == 0.0 else np.array(unsheared(corners, way=way, line_s=self._line_s))


def noise_px(*, contrast: float, blur_px: float) -> float:
    """Returns the deviation of a corner's coordinate by pixel noise, at a contrast (of 255) and a blur of the lens."""
    return NOISE_PX / contrast * sqrt(max(blur_px / SHARP_PX, 1.0))


def lean_of(arms: Points, seen: Points, *, limit_px: float) -> float:
    """Returns the lean (rad) that turns the outline `arms` (4,), px, into `seen` (4,), px; 0 when no lean does.

    Both are about the outline's centre. A leaning mark is shorter in one direction and as long as before in the other,
    up to the perspective of its near and far edges.
    """
    basis = np.stack([arms, arms.conj()], axis=1)
    # The best linear map: seen = a × arms + b × conj(arms); its stretches are |a| + |b| and |a| − |b|.
    (a, b), *_ = np.linalg.lstsq(basis, seen, rcond=None)
    long, short = abs(a) + abs(b), abs(a) - abs(b)
    if not 0.0 < short < 1.0:
        return 0.0
    lean = acos(short)
    radius = float(np.abs(arms).max())
    left_over = float(np.abs(seen - basis @ np.array([a, b])).max())
    perspective = PERSPECTIVE * lean * radius * radius
    return lean if abs(long - 1.0) * radius < limit_px and left_over < limit_px + perspective else 0.0

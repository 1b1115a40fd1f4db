"""A block that rests does not change its shape: what differs from the last frames was done to the picture.

A finger, a highlight or the edge of a shadow can move one edge of the outline without breaking it. While the mark stays
where it is, light and lens give every frame the same outline, and even a small departure tells. Once it has moved by
some pixels the lens and the plate's grain may change the outline as well: it is learned anew at the new place.
"""

from math import acos

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking.judge import PERSPECTIVE

Points = NDArray[np.complex128]

NEAR_PX = 3.0  # within this distance a lens changes an outline by less than is told here
NEAR_ON_GRAIN_PX = 0.7  # the same for the grain of a plate beside bare tape
LEAST_SHARE = 0.1  # of the newest frame in the outline that is remembered
STILL_PX = 0.4  # a mark whose middle has moved further since the last frame does not rest
SYSTEMATIC_PX = 0.03  # departures that sampling and grain may cause
NOISE_PX = 1.2  # deviation of a corner's coordinate by pixel noise, times the contrast (of 255)
DEVIATIONS = 4.0


class RestingShape:
    """The mark's outline while no corner is further than `near_px` from where it was learned."""

    def __init__(self, *, near_px: float) -> None:
        self._near_px = near_px
        self._place: Points | None = None
        self._middle = 0j
        self._frames = 0

    def departed(self, corners: Points) -> tuple[Points, Points] | None:
        """Arms (4,) of the outline about its centre, and of the corners turned onto it.

        None away from its place, or while the mark moves.
        """
        place = self._place
        if place is None or float(np.abs(corners - place).max()) > self._near_px:
            return None
        if abs(complex(corners.mean()) - self._middle) > STILL_PX:
            return None
        arms = place - place.sum() / 4
        seen = corners - corners.sum() / 4
        turn = complex(np.vdot(seen, arms))
        return arms, seen * (turn / max(abs(turn), 1e-9))

    def limit_px(self, contrast: float) -> float:
        """The largest departure that pixel noise and sampling explain."""
        noise = NOISE_PX / contrast * float(np.sqrt(1.0 + 1.0 / max(self._frames, 1)))
        return SYSTEMATIC_PX + DEVIATIONS * noise

    def learn(self, corners: Points) -> None:
        """Takes the corners of a frame that was believed."""
        near = self.departed(corners)
        self._middle = complex(corners.mean())
        if near is None or self._place is None:
            self._place, self._frames = corners, 1
            return
        self._frames += 1
        share = max(1.0 / self._frames, LEAST_SHARE)
        self._place = self._place + share * (near[1] - near[0])


def lean_of(arms: Points, seen: Points, *, limit_px: float) -> float:
    """The lean (rad) that turns the outline `arms` (4,) into `seen`; 0 when no lean does.

    A leaning mark is shorter in one direction and as long as before in the other, up to the perspective of its near
    and far edges.
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

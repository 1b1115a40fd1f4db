"""What motion does to a picture: the smear of the exposure, and the bend by a rolling shutter."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking.lines import Edges

Floats = NDArray[np.float64]
Points = NDArray[np.complex128]

NO_TERM = np.zeros(4)


@dataclass(frozen=True)
class Smear:
    """The way of a moving mark within the exposure: that of its centre (px), and its turn (rad) about it."""

    centre: complex
    path_px: complex
    turn_rad: float

    def across(self, edges: Edges) -> Floats:
        """How far the middles of the edges (4,) move across themselves, in px."""
        return np.abs(self._at_middles(edges))

    def longer(self, edges: Edges, *, than: Floats) -> Floats:
        """How much further than `than` (4,) the edges move across themselves, in px: terms (4, 3) by the place.

        An edge that turns about a place on itself moves both ways; there its smear is next to nothing.
        """
        way = self._at_middles(edges)
        return np.array(
            [np.abs(way) - than, np.where(way < 0.0, -self.turn_rad, self.turn_rad) * edges.free, NO_TERM]
        ).T

    def _at_middles(self, edges: Edges) -> Floats:
        way = self.path_px + (1j * self.turn_rad) * (edges.middle - self.centre)
        return (edges.tangent.conj() * way).imag


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

    def across(self, edges: Edges) -> Floats:
        """How far out the edges have moved (see `shift`): terms (4, 3) by the place.

        A point of an edge has a velocity and a row that change evenly along it: their product has three terms.
        """
        gap = edges.middle - self.centre
        velocity = -(edges.tangent.conj() * (self.velocity_px_s + (1j * self.yaw_rate_rad_s) * gap)).imag
        faster = -self.yaw_rate_rad_s * edges.free
        late, later = gap.imag * self.line_s, edges.tangent.imag * edges.free * self.line_s
        return np.array([velocity * late, velocity * later + faster * late, faster * later]).T

    def shift(self, points: Points) -> Points:
        """How far the points have moved, by the time at which their rows are exposed, since the centre's row was."""
        velocity = self.velocity_px_s + 1j * self.yaw_rate_rad_s * (points - self.centre)
        return velocity * ((points.imag - self.centre.imag) * self.line_s)

    def as_seen(self, corners: Points) -> Points:
        """Corners at their own rows' times from corners at the time of the centre's row."""
        seen = corners + self.shift(corners)
        return corners + self.shift(seen)

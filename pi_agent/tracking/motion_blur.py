"""Describes what motion does to a picture: the blur within the exposure, and the bend by a rolling shutter."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking.lines import Edges

Floats = NDArray[np.float64]
Points = NDArray[np.complex128]


@dataclass(frozen=True)
class MotionBlur:
    """The way of a moving mark within the exposure: that of its centre (px), and its turn (rad) about it."""

    centre: complex
    path_px: complex
    turn_rad: float

    def longer(self, edges: Edges, ways: list[float], *, than: Floats) -> Floats:
        """Returns the way (px) of the edges across themselves beyond `than` (4,): terms (4, 2) by the place.

        `ways`: those of their middles, see `inwards`. An edge that turns about a place on itself moves both ways; there
        its motion blur is next to nothing.
        """
        terms = []
        for way, expected, free in zip(ways, than.tolist(), edges.free.tolist(), strict=True):
            turn = self.turn_rad * free
            terms.append((abs(way) - expected, -turn if way < 0.0 else turn))
        return np.array(terms)

    def inwards(self, edges: Edges) -> list[float]:
        """Returns the way (px) of the edges' middles inwards; plain numbers, for four are faster than an array."""
        path, turn, centre, ways = self.path_px, 1j * self.turn_rad, self.centre, []
        for start, tangent, length in zip(*(part.tolist() for part in edges[:3]), strict=True):
            way = path + turn * (start + 0.5 * length * tangent - centre)
            ways.append((tangent.conjugate() * way).imag)
        return ways


def bend(edges: Edges, *, turn_per_row_rad: float) -> Floats:
    """Returns the bend of a turning mark's edges (4,) by a rolling shutter, outwards: terms (4, 3) by the place.

    Along an edge the velocity across it and the row both change evenly, so their product bends it; the corners, which
    are wanted where and when their own rows saw them, lie on the bent edge, and the bend is counted from the line
    between them. What is even or linear in the rows only moves the corners, and is left in them.
    """
    terms = []
    for tangent, length, free in zip(edges.tangent.tolist(), edges.length.tolist(), edges.free.tolist(), strict=True):
        square = -turn_per_row_rad * tangent.imag
        terms.append((-0.25 * square * length * length, 0.0, square * free * free))
    return np.array(terms)

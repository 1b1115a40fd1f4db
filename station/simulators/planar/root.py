"""The moment at which a block begins to slide, closed in on between two moments."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from station.physics.contact import Array

Excess = Callable[[Array, Array | None], tuple[Array, Array]]
"""E (b,), m/s², at times (b,), s, and the direction (b,), rad, of the sliding that would begin, from a guess at it."""

_ROUNDS = 60
_CLOSE_S, _LEAST_M_S2 = 1e-9, 1e-12


class Bracket(NamedTuple):
    """Times (b,) below and above the zero of E, E there, and the direction above; `side` moved last (+1: above)."""

    low: Array
    below: Array
    high: Array
    above: Array
    way: Array
    side: Array

    def unsure(self) -> NDArray[np.bool_]:
        """Returns a mask (b,): neither is the bracket narrow enough nor E at its upper end small enough."""
        return (self.high - self.low > _CLOSE_S) & (self.above > _LEAST_M_S2)

    def middle(self, unsure: NDArray[np.bool_]) -> Array:
        """Gives the times (b,), s, at which a straight line through both ends is zero, where `unsure` (b,) is true."""
        spread = np.where(unsure, self.above - self.below, 1.0)
        return np.clip(self.high - self.above * (self.high - self.low) / spread, self.low, self.high)

    def narrowed(self, unsure: NDArray[np.bool_], middle: Array, found: tuple[Array, Array]) -> Bracket:
        """Returns the bracket with `middle` (b,), s, in place of one end where `unsure` (b,).

        An end that stays counts half.

        `found` are E (b,), m/s², and the direction (b,), rad, at `middle`.
        """
        value, way = found
        up, down = unsure & (value >= 0), unsure & (value < 0)
        below = np.where(up & (self.side > 0), 0.5 * self.below, self.below)
        above = np.where(down & (self.side < 0), 0.5 * self.above, self.above)
        return Bracket(
            low=np.where(down, middle, self.low),
            below=np.where(down, value, below),
            high=np.where(up, middle, self.high),
            above=np.where(up, value, above),
            way=np.where(up, way, self.way),
            side=np.where(up, 1.0, np.where(down, -1.0, self.side)),
        )


def root(at: Excess, low: Array, high: Array) -> tuple[Array, Array]:
    """Returns the zero (b,) of E between `low` and `high` (b,), s, and the direction (b,) there, by the Illinois rule.

    The upper end of the last bracket is returned, where E is not negative: `low` where E is not negative there.
    """
    bracket = _begun(at, low, high)
    for _ in range(_ROUNDS):
        unsure = bracket.unsure()
        if not unsure.any():
            break
        middle = bracket.middle(unsure)
        bracket = bracket.narrowed(unsure, middle, at(middle, bracket.way))
    return bracket.high, bracket.way


def _begun(at: Excess, low: Array, high: Array) -> Bracket:
    below, way = at(low, None)
    above, way_high = at(high, None)
    early = below >= 0
    ends = np.where(early, low, high), np.where(early, below, above), np.where(early, way, way_high)
    return Bracket(low, below, *ends, np.zeros(len(low)))

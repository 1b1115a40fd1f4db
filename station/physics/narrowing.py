"""Newton's method in a bracket, for many numbers at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from station.physics.contact import Array

_LEAST_SLOPE = 1e-3
_FINEST = 1e-7
"""A smaller step is Newton's last, and rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class Bracket:
    """Brackets from `low` to `high` (n,) of rising functions' zeros, tried at `at`, `moved` from the last place."""

    low: Array
    high: Array
    at: Array
    moved: Array

    @classmethod
    def around(cls, count: int, farthest: float) -> Bracket:
        """Returns brackets (count,) from −farthest to farthest, which begin in their middles."""
        return cls(np.full(count, -farthest), np.full(count, farthest), np.zeros(count), np.full(count, np.inf))

    def narrowed(self, value: Array, slope: Array) -> Bracket:
        """Returns the narrower bracket from the functions' `value` (n,) and `slope` (n,) at `at`, in their units.

        A value's sign says on which side the zero lies, also where Newton's step is worthless; the next place is
        Newton's if that is inside and the steps at least halve, else the middle (Press et al. 2007, section 9.4).
        """
        low, high = np.where(value < 0, self.at, self.low), np.where(value < 0, self.high, self.at)
        newton = self.at - value / np.where(slope > _LEAST_SLOPE, slope, np.nan)
        step = np.abs(newton - self.at)
        good = (newton >= low) & (newton <= high) & (step <= np.maximum(0.5 * self.moved, _FINEST))
        at = np.where(good, newton, 0.5 * (low + high))
        return Bracket(low, high, at, np.abs(at - self.at))

    def settled(self, within: float) -> bool:
        """Returns true if no place has moved by `within` or more."""
        return bool(np.max(self.moved, initial=0.0) < within)

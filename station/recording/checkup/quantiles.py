"""Quantiles of any number of values in a fixed amount of memory."""

from __future__ import annotations

import math
from collections import Counter

_PER_DECADE = 231  # steps of 1 %
_SMALLEST_NS = 100.0


class Quantiles:
    """A histogram of durations in nanoseconds, 1 % wide bins from 100 ns upwards; smaller values count as 100 ns."""

    def __init__(self) -> None:
        self._bins: Counter[int] = Counter()
        self.count = 0
        self.smallest_ns = math.inf
        self.largest_ns = -math.inf

    def add(self, duration_ns: int) -> None:
        """Takes one duration, which may be negative."""
        self.count += 1
        self.smallest_ns = min(self.smallest_ns, duration_ns)
        self.largest_ns = max(self.largest_ns, duration_ns)
        self._bins[round(_PER_DECADE * math.log10(max(duration_ns, _SMALLEST_NS) / _SMALLEST_NS))] += 1

    def at(self, share: float) -> float:
        """Returns the value (ns) that `share` (0 to 1) of all lie at or below, within 1 %; NaN without values."""
        wanted, seen = share * self.count, 0
        for index in sorted(self._bins):
            seen += self._bins[index]
            if seen >= wanted:
                middle = _SMALLEST_NS * 10 ** (index / _PER_DECADE)
                return min(max(middle, self.smallest_ns), self.largest_ns)
        return math.nan

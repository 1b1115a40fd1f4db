"""The tilting angles of a run: 50 steps of the whole range, or of where this direction slips (section IV)."""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from station.sampling.plan import TiltPlan


class AngleRange:
    """Remembers the onset angles of each direction and gives the steps of the next run.

    A block that did not slip within a narrowed range lies where friction is higher than in most places, and would lie
    there for ever: until it slips the next runs have the whole range again.
    """

    def __init__(self, plan: TiltPlan) -> None:
        self._plan = plan
        self._onsets_rad: dict[int, list[float]] = defaultdict(list)
        self._held = False

    def add(self, sector: int, onset_rad: float) -> None:
        """Takes one more onset angle in this direction; censored runs have none and are not added."""
        self._onsets_rad[sector].append(onset_rad)
        self._held = False

    def add_held(self) -> None:
        """Notes that the block did not slip up to the highest angle that was tried."""
        self._held = True

    def bounds_rad(self, sector: int, *, limit_rad: float) -> tuple[float, float]:
        """Returns the lowest and highest angle to try; `limit_rad` is what the arm can reach in this direction."""
        top = min(np.radians(self._plan.max_deg), limit_rad)
        onsets = self._onsets_rad[sector]
        # One onset has no spread.
        if self._held or not self._plan.adapt_after or len(onsets) < max(self._plan.adapt_after, 2):
            return 0.0, top
        mean, spread = float(np.mean(onsets)), self._plan.adapt_sd * float(np.std(onsets, ddof=1))
        return min(max(0.0, mean - spread), top), min(mean + spread, top)

    def steps_rad(self, sector: int, *, limit_rad: float) -> tuple[float, ...]:
        """Returns the angles to go to, ascending. The first is the lower bound itself, unless that is level."""
        low, high = self.bounds_rad(sector, limit_rad=limit_rad)
        angles = np.linspace(low, high, self._plan.steps + 1)
        return tuple(float(angle) for angle in (angles if low > 0 else angles[1:]))

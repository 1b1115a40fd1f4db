"""The paper's procedure as a list of stops: tilt from 0 to 10 degrees and back, five times."""

from __future__ import annotations

import math
from dataclasses import dataclass

DONE_PHASE, READ_PHASE = "DONE", "DWELL"
"""The phases of `session/event` between which the readings of a stop count."""


@dataclass(frozen=True, kw_only=True)
class ComparisonPlan:
    """The way in which the plate is moved and read.

    A stop is read for `readings` readings of every source, `settle_s` after the arm came to rest. With `way_back` the
    plate also stops on its way down: without it there is no hysteresis to be seen. A source that has said nothing for
    `patience_s` is no longer waited for at a stop (`answer_s` for those that are asked, such as a person).
    """

    to_deg: float = 10.0
    step_deg: float = 1.0
    sweeps: int = 5
    readings: int = 50
    direction: int = 0
    rate_deg_s: float = 5.0
    settle_s: float = 0.5
    way_back: bool = True
    patience_s: float = 3.0
    answer_s: float = 600.0
    start_s: float = 10.0

    def __post_init__(self) -> None:
        for name in ("to_deg", "step_deg", "rate_deg_s", "patience_s", "answer_s", "start_s"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"expected a positive number for {name}, got {value}")
        if self.sweeps < 1 or self.readings < 1 or self.settle_s < 0:
            raise ValueError("expected at least one sweep, one reading a stop, and a settle_s that is not negative")
        if self.step_deg > self.to_deg:
            raise ValueError(f"expected steps smaller than the tilt of {self.to_deg} degrees, got {self.step_deg}")


@dataclass(frozen=True, slots=True)
class PlannedStop:
    """One stop: its sweep (from 1), its number within the sweep (from 1), and the tilt that is asked for."""

    sweep: int
    step: int
    angle_rad: float


def planned_stops(plan: ComparisonPlan) -> tuple[PlannedStop, ...]:
    """Returns all stops in order.

    Sweeps share the level stop between them; with a way back the last one ends at level.
    """
    count = math.floor(plan.to_deg / plan.step_deg + 1e-9)
    up = [index * plan.step_deg for index in range(count + 1)]
    down = up[-2:0:-1] if plan.way_back else []
    stops = [
        PlannedStop(sweep, step, math.radians(angle))
        for sweep in range(1, plan.sweeps + 1)
        for step, angle in enumerate([*up, *down], start=1)
    ]
    last = [PlannedStop(plan.sweeps, len(up) + len(down) + 1, 0.0)] if plan.way_back else []
    return (*stops, *last)

"""plan.toml: every constant of the acquisition, with the paper's value as default."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from shared.config import load_table, parse
from shared.possible import LEAST, require_measurable

MOST_STEPS = 9_000
"""The largest number of steps of a tilt: a hundredth of a degree each up to the vertical. It moves the edge of a plate
of 100 mm by 9 µm, which is finer than arms repeat (some 20 µm)."""

MOST_FRAMES = 10_000
"""The largest number of frames of a reference: two minutes at 90 Hz, whose mean has a hundredth of one frame's noise.
All are held until the last has come, and a plan may be a stranger's, inside a recording."""


@dataclass(frozen=True, kw_only=True)
class ReferencePlan:
    """`[reference]`: where the block is before the tilt.

    The corners are averaged over `frames`; while their standard deviation exceeds `noise_limit_px` the reading is
    refused and repeated, up to `attempts` times.
    """

    frames: int = 10
    noise_limit_px: float = 1.0
    attempts: int = 10

    def __post_init__(self) -> None:
        require_measurable(self)
        if not 2 <= self.frames <= MOST_FRAMES or self.attempts < 1 or not self.noise_limit_px > 0:
            raise ValueError(
                f"expected frames of 2 to {MOST_FRAMES}, attempts >= 1 and noise_limit_px > 0, got {self.frames}, "
                f"{self.attempts} and {self.noise_limit_px:g}"
            )


@dataclass(frozen=True, kw_only=True)
class TiltPlan:
    """`[tilt]`: the loop over tilting angles.

    `steps` from 0 to `max_deg`; once `adapt_after` samples of a direction are there, from mean − `adapt_sd` to
    mean + `adapt_sd` standard deviations of that direction. Between steps the arm moves at `rate_deg_s` and then holds
    for `hold_s`. `adapt_after = 0` never narrows the range. If `rates_deg_s` has rates, each run's is drawn from them
    at random, in place of `rate_deg_s`.
    """

    steps: int = 50
    max_deg: float = 67.5
    adapt_after: int = 25
    adapt_sd: float = 3.0
    rate_deg_s: float = 5.0
    rates_deg_s: tuple[float, ...] = ()
    return_rate_deg_s: float = 20.0
    hold_s: float = 0.1

    def __post_init__(self) -> None:
        require_measurable(self)
        if not 1 <= self.steps <= MOST_STEPS:
            raise ValueError(f"expected steps of 1 to {MOST_STEPS}, got {self.steps}")
        if not 0 < self.max_deg < 90 or min(self.rate_deg_s, self.return_rate_deg_s) < LEAST:
            raise ValueError(f"expected 0 < max_deg < 90 and rates of {LEAST:g} or more")
        if min(self.rates_deg_s, default=LEAST) < LEAST:
            raise ValueError(f"expected rates_deg_s of {LEAST:g} or more, got {list(self.rates_deg_s)}")
        if min(self.adapt_after, self.adapt_sd, self.hold_s) < 0:
            raise ValueError("expected adapt_after, adapt_sd and hold_s of 0 or more")


@dataclass(frozen=True, kw_only=True)
class SlipPlan:
    """`[slip]`: a slip is reported when `corners` of the 4 have moved more than l = `base_px` + `per_deg_px` · θ°.

    The attitude is averaged over the `average_s` up to then, in which the block began to move, so that the plate can go
    back at once, before the block reaches the border; it may slide on for `settle_s` if that is wanted. At rest it is
    when it has moved less than `rest_px` in `rest_s`, for which the level plate waits up to `rest_timeout_s`.
    """

    corners: int = 3
    base_px: float = 10.0
    per_deg_px: float = 1.0
    average_s: float = 0.3
    settle_s: float = 0.0
    rest_px: float = 0.5
    rest_s: float = 0.2
    rest_timeout_s: float = 1.0

    def __post_init__(self) -> None:
        require_measurable(self)
        if not 1 <= self.corners <= 4 or self.base_px <= 0 or self.average_s <= 0:
            raise ValueError("expected 1 <= corners <= 4, base_px > 0 and average_s > 0")


@dataclass(frozen=True, kw_only=True)
class DwellPlan:
    """`[dwell]`: how long the block rests before the tilt, drawn log-uniformly from `min_s` to `max_s` for each run."""

    min_s: float = 0.5
    max_s: float = 0.5

    def __post_init__(self) -> None:
        require_measurable(self)
        if not 0 < self.min_s <= self.max_s:
            raise ValueError(f"expected 0 < min_s <= max_s, got {self.min_s} and {self.max_s}")


@dataclass(frozen=True, kw_only=True)
class DirectionPlan:
    """`[direction]`: where to tilt: the paper's `four` directions (or `some` of them) or a `free` azimuth.

    The weight of a direction is the block's distance to the image's border there, to the power of `distance_power`;
    directions in which it could slide less than `min_slide_px`, to there or to the foam, are left out while there are
    others.
    """

    mode: Literal["four", "free"] = "four"
    some: tuple[int, ...] = (0, 1, 2, 3)
    distance_power: float = 1.0
    min_slide_px: float = 60.0

    def __post_init__(self) -> None:
        require_measurable(self)
        if self.distance_power < 0:
            raise ValueError(f"expected distance_power >= 0, got {self.distance_power:g}")
        if not self.some or not set(self.some) <= {0, 1, 2, 3}:
            raise ValueError(f"expected some of the directions 0, 1, 2 and 3, got {list(self.some)}")


@dataclass(frozen=True, kw_only=True)
class Plan:
    """A plan file. `samples` is how many runs are wanted; `seed` drives every random choice of the session.

    `timeout_s`: how long the machine waits for an answer, for corners, or for a motion's end beyond the time that the
    motion takes at its rate, before it gives the run up;
    `silence_s`: how long corners and attitudes may stay away, or be late, while every frame counts;
    `faults`: how many runs may fail in a row before the session stops; those that the network ended do not count.
    `outage_s`: how long a session waits, level, for an agent that cannot be heard or a frozen camera (0: for ever).
    """

    samples: int = 50
    seed: int = 1
    timeout_s: float = 15.0
    silence_s: float = 1.0
    faults: int = 5
    outage_s: float = 0.0
    reference: ReferencePlan = field(default_factory=ReferencePlan)
    tilt: TiltPlan = field(default_factory=TiltPlan)
    slip: SlipPlan = field(default_factory=SlipPlan)
    dwell: DwellPlan = field(default_factory=DwellPlan)
    direction: DirectionPlan = field(default_factory=DirectionPlan)

    def __post_init__(self) -> None:
        require_measurable(self, but=("seed",))
        if self.samples < 1 or self.faults < 1 or self.seed < 0:
            raise ValueError(
                f"expected samples >= 1, faults >= 1 and seed >= 0, got {self.samples}, {self.faults} and {self.seed}"
            )
        if self.outage_s < 0:
            raise ValueError(f"expected outage_s >= 0, got {self.outage_s:g}")
        if self.timeout_s <= 0 or self.silence_s <= 0:
            raise ValueError(f"expected timeout_s > 0 and silence_s > 0, got {self.timeout_s:g} and {self.silence_s:g}")

    @property
    def max_rad(self) -> float:
        """The highest tilt that the plan asks for."""
        return math.radians(self.tilt.max_deg)


def load_plan(path: Path) -> Plan:
    """Reads a plan file.

    Raises:
        UserError: naming file, line and key of what is wrong.
    """
    return parse(Plan, load_table(path))

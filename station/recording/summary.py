"""Summarises a session's samples: mean and spread of the onset angle by direction."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass

from shared.messages import Sample


@dataclass(frozen=True, kw_only=True)
class DirectionSummary:
    """The runs of one direction (−1: free azimuth).

    `mean_rad` and `sd_rad` (n − 1 in the denominator) are over the kept samples only: neither flagged nor censored.
    They are NaN without enough of them. Leaving censored runs out biases the mean downwards, hence their count.
    """

    direction: int
    kept: int
    censored: int
    flagged: int
    mean_rad: float
    sd_rad: float


def is_kept(sample: Sample) -> bool:
    """Returns true if a sample counts in a mean: it slipped, and no filter rejected it."""
    return not sample.censored and not sample.flags


def by_direction(samples: Sequence[Sample]) -> tuple[DirectionSummary, ...]:
    """Returns one summary for each direction that occurs, in order."""
    return tuple(
        _summary(direction, [sample for sample in samples if sample.direction == direction])
        for direction in sorted({sample.direction for sample in samples})
    )


def _summary(direction: int, samples: Sequence[Sample]) -> DirectionSummary:
    angles = [sample.onset_angle_rad for sample in samples if is_kept(sample)]
    censored = sum(sample.censored for sample in samples)
    finite = angles if all(map(math.isfinite, angles)) else []  # an infinite angle has neither a mean nor a spread
    return DirectionSummary(
        direction=direction,
        kept=len(angles),
        censored=censored,
        flagged=len(samples) - len(angles) - censored,
        mean_rad=statistics.fmean(finite) if finite else math.nan,
        sd_rad=statistics.stdev(finite) if len(finite) > 1 else math.nan,
    )


def degrees(angle_rad: float) -> str:
    """Returns an angle in degrees with two decimals; a dash without one."""
    return "–" if math.isnan(angle_rad) else f"{math.degrees(angle_rad):.2f}"


def sd_degrees(angle_rad: float) -> str:
    """Returns the standard deviation of such an angle, with as many decimals: "<0.01" where they would show zero."""
    if not angle_rad > 0:
        return "–"
    return "<0.01" if math.degrees(angle_rad) < 0.005 else degrees(angle_rad)

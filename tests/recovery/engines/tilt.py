"""The tilt test: gravity turns slowly until the object has slid, and the angle at which it began is read."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tests.recovery.engines import Array, Bench

G_M_S2 = 9.81
RATE_RAD_S = math.radians(2)
SEEN_M = 0.5e-3
STEEPEST_RAD = math.radians(85)
_SETTLE_S = 0.5
_QUICK_S = 0.5


@dataclass(frozen=True)
class Onset:
    """The angle at which the object began to slide, and how far it had crept half a degree before it should (m)."""

    angle_rad: float
    crept_m: float


def onset(bench: Bench, downhill_rad: float, *, expected_rad: float) -> Onset:
    """The angle of repose towards a direction.

    The first part of the way, up to six degrees below what is expected, is quick; what slides on it is seen, too.
    A block that slides from rest at the critical angle, under a tilt that goes on at the rate w, has moved by
    g w t³ / (6 cos θ): the angle is put back by what it takes to be seen.
    """
    for _ in range(round(_SETTLE_S / bench.step_s)):
        bench.advance(gravity(0.0, downhill_rad))
    start, crept, angle, quick = bench.place_m(), math.nan, 0.0, max(expected_rad - math.radians(6), 0.0)
    while angle < STEEPEST_RAD:
        rate = quick / _QUICK_S if angle < quick else RATE_RAD_S
        angle += rate * bench.step_s
        bench.advance(gravity(angle, downhill_rad))
        moved = float(np.linalg.norm((bench.place_m() - start)[:2]))
        if math.isnan(crept) and angle > expected_rad - math.radians(0.5):
            crept = moved
        if moved > SEEN_M:
            break
    else:
        return Onset(math.nan, crept)
    late = (6 * SEEN_M * math.cos(angle) * RATE_RAD_S**2 / G_M_S2) ** (1 / 3) if angle > quick else 0.0
    return Onset(angle - late, moved if math.isnan(crept) else crept)


def gravity(tilt_rad: float, downhill_rad: float) -> Array:
    """Gravity (3) as a plate sees it that is tilted down towards a direction."""
    along = G_M_S2 * math.sin(tilt_rad)
    return np.array([along * math.cos(downhill_rad), along * math.sin(downhill_rad), -G_M_S2 * math.cos(tilt_rad)])

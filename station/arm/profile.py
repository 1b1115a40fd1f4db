"""The tilt angle over time in one motion: stretches of constant jerk, as plain numbers.

ruckig plans them. Its own object is not kept: it is not an array, so that many moments must be asked for one by one,
and the library complains of each one that is still there when the process ends.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Profile:
    """Stretches (k,) that begin at `starts_s`, the first one at 0, with angle, rate, acceleration and jerk then."""

    duration_s: float
    starts_s: tuple[float, ...]
    angles_rad: tuple[float, ...]
    rates_rad_s: tuple[float, ...]
    accelerations_rad_s2: tuple[float, ...]
    jerks_rad_s3: tuple[float, ...]

    @cached_property
    def _stretches(self) -> Array:
        """Start, angle, rate, acceleration and jerk of each stretch, (5, k)."""
        states = (self.angles_rad, self.rates_rad_s, self.accelerations_rad_s2, self.jerks_rad_s3)
        return np.array([self.starts_s, *states])

    def at(self, seconds: ArrayLike) -> tuple[Array, Array, Array]:
        """Angle, rate and acceleration, each (...), at times (...), which are clipped to the motion."""
        time = np.minimum(np.maximum(seconds, 0.0), self.duration_s)
        stretches = self._stretches
        start, angle, rate, acceleration, jerk = stretches[:, stretches[0].searchsorted(time, side="right") - 1]
        u = time - start
        return (
            angle + u * (rate + u * (acceleration / 2 + u * jerk / 6)),
            rate + u * (acceleration + u * jerk / 2),
            acceleration + u * jerk,
        )


def profile_of(trajectory: Any) -> Profile:
    """The profile of a ruckig trajectory of one degree of freedom: its brake, and then its seven phases."""
    phases = trajectory.profiles[0][0]
    rows: list[tuple[float, ...]] = []
    start_s = 0.0
    for part in (phases.brake, phases):
        for row in zip(part.t, part.p, part.v, part.a, part.j, strict=False):  # states are given for the end as well
            if row[0] > 0.0:
                rows.append((start_s, *row[1:]))
                start_s += row[0]
    if not rows:  # no way to go
        rows.append((0.0, *(state[0] for state in trajectory.at_time(0.0)), 0.0))
    starts, angles, rates, accelerations, jerks = zip(*rows, strict=True)
    return Profile(
        duration_s=float(trajectory.duration),
        starts_s=starts,
        angles_rad=angles,
        rates_rad_s=rates,
        accelerations_rad_s2=accelerations,
        jerks_rad_s3=jerks,
    )

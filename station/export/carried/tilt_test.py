"""The tilt test: gravity turns in a plate's frame as if the plate were tilted, and a block's path is written down."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np

from station.physics.contact import GRAVITY_M_S2, Array

SEEN_M = 1e-4
"""The way after which a slide counts as seen: hundreds of times what a good contact creeps before it."""


class Bench(Protocol):
    """A block on a plate in some engine."""

    step_s: float

    def advance(self, gravity: Array) -> Array:
        """One step under gravity (3,), m/s², in the plate's frame; gives the block's x, y (m) and yaw (rad) after it."""
        ...


class Ramp(NamedTuple):
    """The plate is held at `from_rad` for `held_s`, and then tilts at `rate_rad_s` for `seconds`, down to `down_rad`."""

    down_rad: float
    from_rad: float
    rate_rad_s: float
    seconds: float
    held_s: float = 0.3

    def tilt_rad(self, time_s: float) -> float:
        """The tilt at a time."""
        return self.from_rad + self.rate_rad_s * max(time_s - self.held_s, 0.0)

    def gravity(self, time_s: float) -> Array:
        """Gravity (3,), m/s², in the plate."""
        along, down = GRAVITY_M_S2 * math.sin(self.tilt_rad(time_s)), self.down_rad
        return np.array(
            [along * math.cos(down), along * math.sin(down), -GRAVITY_M_S2 * math.cos(self.tilt_rad(time_s))]
        )


def tilt_test(bench: Bench, ramp: Ramp) -> Array:
    """Rows of time (s), tilt (rad), x, y (m) and yaw (rad), one after each step."""
    count = round((ramp.held_s + ramp.seconds) / bench.step_s)
    rows = list[list[float]]()
    for number in range(count):
        place = bench.advance(ramp.gravity(number * bench.step_s))
        time_s = (number + 1) * bench.step_s
        rows.append([time_s, ramp.tilt_rad(time_s), *place.tolist()])
    return np.array(rows)


def onset(path: Array) -> float:
    """The row of `tilt_test`, as a fraction, at which the block has gone `SEEN_M`; nan where it has not."""
    gone = np.hypot(*(path[:, 2:4] - path[0, 2:4]).T)
    seen = np.flatnonzero(gone > SEEN_M)
    if not len(seen) or not seen[0]:
        return math.nan
    return float(seen[0] - (gone[seen[0]] - SEEN_M) / (gone[seen[0]] - gone[seen[0] - 1]))


def show(bench: Bench, ramp: Ramp) -> None:
    """Prints when the block starts, and where it is at the end."""
    path = tilt_test(bench, ramp)
    tilt, gone = math.degrees(np.interp(onset(path), np.arange(len(path)), path[:, 1])), path[-1, 2:4] - path[0, 2:4]
    print(f"down to {math.degrees(ramp.down_rad):4.0f} degrees: seen to slide at {tilt:.3f} degrees of tilt,", end=" ")
    print(f"{1e3 * math.hypot(*gone):.2f} mm away at {math.degrees(path[-1, 1]):.2f} degrees")

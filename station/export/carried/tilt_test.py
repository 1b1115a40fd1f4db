"""The tilt test: gravity turns in a plate's frame as if the plate were tilted, and a block's path is written down."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from station.physics.contact import GRAVITY_M_S2, Array

SEEN_M = 1e-4
"""The way after which a slide counts as seen: hundreds of times what a good contact creeps before it."""


class Bench(Protocol):
    """A block on a plate in some engine."""

    step_s: float

    def advance(self, gravity: Array) -> Array:
        """Takes one step under gravity (3,), m/s², in the plate's frame.

        It returns x, y (m) and yaw (rad), (3,), after it.
        """
        ...


class Ramp(NamedTuple):
    """A plate is held at `from_rad` for `held_s`, and then tilts at `rate_rad_s` for `seconds` towards `down_rad`."""

    down_rad: float
    from_rad: float
    rate_rad_s: float
    seconds: float
    held_s: float = 0.3

    def tilt_rad(self, time_s: float) -> float:
        """Returns the tilt at a time."""
        return self.from_rad + self.rate_rad_s * max(time_s - self.held_s, 0.0)

    def gravity(self, time_s: float) -> Array:
        """Returns gravity (3,), m/s², in the plate."""
        along, down = GRAVITY_M_S2 * math.sin(self.tilt_rad(time_s)), self.down_rad
        return np.array(
            [along * math.cos(down), along * math.sin(down), -GRAVITY_M_S2 * math.cos(self.tilt_rad(time_s))]
        )


def tilt_test(bench: Bench, ramp: Ramp, *, enough_m: float = math.inf) -> Array:
    """Returns rows (m, 5) of time (s), tilt (rad), x, y (m) and yaw (rad), one a step, until the block went `enough_m`.

    They begin with the ramp: while the plate is held, a block settles into its contact.
    """
    count = round((ramp.held_s + ramp.seconds) / bench.step_s)
    rows = list[list[float]]()
    for number in range(count):
        place = bench.advance(ramp.gravity(number * bench.step_s))
        time_s = (number + 1) * bench.step_s
        if time_s < ramp.held_s:
            continue
        rows.append([time_s, ramp.tilt_rad(time_s), *place.tolist()])
        if math.hypot(place[0] - rows[0][2], place[1] - rows[0][3]) > enough_m:
            break
    return np.array(rows)


def onset(path: Array) -> float:
    """Returns the row of `path` (n, 5), as a fraction, at which the block has gone `SEEN_M`; nan where it has not.

    Its rows and their units are those of `tilt_test`.
    """
    gone = np.hypot(*(path[:, 2:4] - path[0, 2:4]).T)
    seen = np.flatnonzero(gone > SEEN_M)
    if not len(seen) or not seen[0]:
        return math.nan
    return float(seen[0] - (gone[seen[0]] - SEEN_M) / (gone[seen[0]] - gone[seen[0] - 1]))


def show(make: Callable[[], Bench], *, about_rad: float) -> None:
    """Tilts a new block from `make` in each of four directions past `about_rad`, and prints when it starts."""
    for down in range(0, 360, 90):
        ramp = Ramp(math.radians(down), max(about_rad - 0.1, 0.0), math.radians(4), 10.0)
        path = tilt_test(make(), ramp, enough_m=0.02)
        tilt = math.degrees(np.interp(onset(path), np.arange(len(path)), path[:, 1]))
        gone_mm = 1e3 * math.hypot(*(path[-1, 2:4] - path[0, 2:4]))
        end = math.degrees(path[-1, 1])
        print(
            f"down {down:3d} degrees: slides at {tilt:.2f} degrees of tilt, {gone_mm:.1f} mm away at {end:.1f} degrees"
        )

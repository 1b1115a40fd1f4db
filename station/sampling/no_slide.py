"""A path that is no slide: gravity, and a friction that only brakes, cannot have made it.

A knock at the camera, a finger at the block, or a second mark moves the picture as far as a slide does, but not in its
direction, or sooner. A block that slides begins from rest; it goes down the plate or aside of that, never up, and is
never faster than without friction: L from its rest it has taken at least √(2 L / a) s, with a the pull along its way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shared.geometry import Array
from station.friction.onset_loads import GRAVITY_M_S2
from station.sampling.plan import SlipPlan
from station.signals.downhill import DOWNHILL_RAD, LEAST

UNLEVEL_RAD = 0.02
"""The plate may be tilted so much farther than is read: twice the error of level that rigs typically have
(`platform_level` in `station effects`)."""


@dataclass(frozen=True, slots=True)
class Seen:
    """A path as the frames show it: times (n,), ns, places (n, 2) on the plate, m, and the plate's tilts (n,), rad."""

    time_ns: NDArray[np.int64]
    place_m: Array
    tilt_rad: Array

    @property
    def time_s(self) -> Array:
        """Returns the times (n,) since the first frame, s."""
        return (self.time_ns - self.time_ns[0]) * 1e-9

    def first(self, frames: int) -> Seen:
        """Returns the path in so many of its frames."""
        return Seen(self.time_ns[:frames], self.place_m[:frames], self.tilt_rad[:frames])


def is_no_slide(seen: Seen, *, down: Array, plan: SlipPlan, m_per_px: float) -> bool:
    """Returns true if gravity cannot have taken a block along a path up to the detection of its slip.

    Args:
        seen: the path, from before the slide.
        down: unit vector (2,) of the steepest way down the plate.
        plan: says what rest is, and how far a camera may sag.
        m_per_px: the picture's scale on the plate, m/px.
    """
    rest = last_at_rest(seen, plan=plan, m_per_px=m_per_px)
    way = seen.place_m[rest:] - seen.place_m[rest]
    loose_m = m_per_px * _loose_px(plan, seen.tilt_rad[rest:], from_rad=float(seen.tilt_rad[rest]))
    length = np.linalg.norm(way, axis=1)
    ahead = float(way[-1] @ down)
    # A convex limit curve turns a slide by no more than the arc cosine of its least friction over its greatest.
    if ahead + float(loose_m[-1]) < math.cos(DOWNHILL_RAD) * float(length[-1]):
        return True
    steep = math.sin(float(seen.tilt_rad[rest:].max())) * ahead / max(float(length[-1]), LEAST)
    pull_m_s2 = GRAVITY_M_S2 * (max(steep, 0.0) + UNLEVEL_RAD)
    return _is_too_fast(seen.time_s[rest:], length, loose_m=loose_m, pull_m_s2=pull_m_s2)


def _is_too_fast(time_s: Array, length_m: Array, *, loose_m: Array, pull_m_s2: float) -> bool:
    """Returns true if a block that begins from rest and is pulled like this cannot have come so far, frame by frame.

    Without friction it left √(2 L / a) before each frame. Friction makes that later from frame to frame, never earlier.
    """
    latest_s = time_s - np.sqrt(2.0 * np.maximum(length_m - loose_m, 0.0) / pull_m_s2)
    earliest_s = time_s - np.sqrt(2.0 * (length_m + loose_m) / pull_m_s2)
    return bool((latest_s[1:] < np.maximum.accumulate(earliest_s)[:-1]).any())


def last_at_rest(seen: Seen, *, plan: SlipPlan, m_per_px: float) -> int:
    """Returns the last frame before which the block lay still for `rest_s`; the first frame if there is none."""
    begins = np.searchsorted(seen.time_s, seen.time_s - plan.rest_s, side="right") - 1
    for last in range(len(seen.time_s) - 1, 0, -1):
        span = slice(max(int(begins[last]), 0), last + 1)
        moved_px = np.linalg.norm(seen.place_m[span] - seen.place_m[last], axis=1) / m_per_px
        loose_px = _loose_px(plan, seen.tilt_rad[span], from_rad=float(seen.tilt_rad[last]))
        if begins[last] >= 0 and bool((moved_px <= loose_px).all()):
            return last
    return 0


def _loose_px(plan: SlipPlan, tilt_rad: Array, *, from_rad: float) -> Array:
    """Returns how far the picture of a block at rest may move between one tilt and others (n,), px.

    It is the noise that the plan allows at rest, and the sag of the camera that its slip rule allows.
    """
    return plan.rest_px + plan.per_deg_px * np.degrees(np.abs(tilt_rad - from_rad))

"""Too little seen of a slide: frames or attitudes that are missing where the block began to move.

The onset is fitted to the path of a free slide, and no fit tells what happened between two frames.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from shared.geometry import Array
from station.friction.onset_loads import GRAVITY_M_S2

Moved = tuple[int, float]
"""A frame's time, ns, and how far the block lay from its reference then, m."""


def reach_m(speed_m_s: Array | float, apart_s: Array | float, *, tilt_rad: Array | float) -> Array:
    """Returns how far (n,), m, blocks may go in times (n,), s: nothing is accelerated by more than g sin θ."""
    pull_m_s2 = GRAVITY_M_S2 * np.sin(np.maximum(tilt_rad, 0.0))
    return np.asarray(speed_m_s * apart_s + 0.5 * pull_m_s2 * np.square(apart_s))


def may_have_met_foam(frames: Sequence[Moved], *, from_ns: int, way_m: float, tilt_rad: float) -> bool:
    """Returns true if a block may have come to the foam between two frames, the later of them after `from_ns`.

    From one frame on it goes as fast as it went before, or farther by `reach_m`.

    Args:
        frames: the frames up to the detection of the slip.
        from_ns: the onset.
        way_m: the way that the foam leaves to the block, m; may be infinite.
        tilt_rad: the plate's tilt θ.
    """
    speed_m_s = 0.0
    for (before_ns, before_m), (after_ns, after_m) in pairwise(frames):
        apart_s = (after_ns - before_ns) * 1e-9
        if after_ns > from_ns and before_m + reach_m(speed_m_s, apart_s, tilt_rad=tilt_rad) > way_m:
            return True
        speed_m_s = max(after_m - before_m, 0.0) / apart_s if apart_s > 0.0 else speed_m_s
    return False


def are_away(readings_ns: Sequence[int], *, from_ns: int, to_ns: int) -> bool:
    """Returns true if readings stay away for longer than half of a slide, in it or about one of its ends.

    An arm agent sends a hundred attitudes a second, and slides up to their detection last a tenth of a second and more.
    """
    return any(
        before_ns < to_ns and after_ns > from_ns and 2 * (after_ns - before_ns) > to_ns - from_ns
        for before_ns, after_ns in pairwise(readings_ns)
    )

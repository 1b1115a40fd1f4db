"""The highest point of a smooth function of a dozen parameters within bounds: BFGS on those that are not held by one.

SciPy's L-BFGS-B finds the same, but its calls of BLAS wait for threads that such small matrices do not need, which
takes several times as long as the likelihood itself when the machine is busy.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from station.friction.direction import Array
from station.friction.slides import Bools

_STEPS = 200
_HALVINGS = 30
_LEAST_GAIN = 1e-7
_ENOUGH = 1e-4
_FLAT = 1e-3


def climb(height: Callable[[Array], tuple[float, Array]], start: Array, *, low: Array, high: Array) -> Array:
    """Returns the parameters (k,) of the maximum that is reached from `start` (k,).

    Args:
        height: value and gradient (k,); its parameters should be scaled so that steps of about 1 matter alike.
        start: within the bounds.
        low: least values (k,).
        high: greatest values (k,).
    """
    at, (value, slope) = start, height(start)
    curvature, flat = np.eye(len(start)), 0
    for _ in range(_STEPS):
        free = ~(((at <= low) & (slope < 0)) | ((at >= high) & (slope > 0)))
        if float(np.abs(slope[free]).max(initial=0.0)) < _FLAT:
            break
        way = _way(curvature, slope, free)
        found = _along(height, at, way, value=value, slope=slope, low=low, high=high)
        if found is None:
            # A bent model may point downhill; the plain gradient does not.
            if np.array_equal(curvature, np.eye(len(start))):
                break
            curvature = np.eye(len(start))
            continue
        after, value_after, slope_after = found
        curvature = _updated(curvature, after - at, slope - slope_after)
        flat = flat + 1 if value_after - value < _LEAST_GAIN else 0
        at, value, slope = after, value_after, slope_after
        if flat == 2:
            break
    return at


def _way(curvature: Array, slope: Array, free: Bools) -> Array:
    way = np.zeros(len(slope))
    way[free] = np.linalg.solve(curvature[np.ix_(free, free)], slope[free])
    # Not farther than a dozen of the scale in one step.
    longest = float(np.abs(way).max(initial=0.0))
    return way * min(1.0, 12.0 / longest) if longest > 0 else way


def _along(
    height: Callable[[Array], tuple[float, Array]],
    at: Array,
    way: Array,
    *,
    value: float,
    slope: Array,
    low: Array,
    high: Array,
) -> tuple[Array, float, Array] | None:
    """Returns a point that is high enough along the way, kept within the bounds, with value and gradient."""
    share = 1.0
    for _ in range(_HALVINGS):
        there = np.minimum(np.maximum(at + share * way, low), high)
        promised = float(slope @ (there - at))
        if promised <= 0:
            return None
        found, slope_there = height(there)
        if found >= value + _ENOUGH * promised:
            return there, found, slope_there
        # The parabola through what is known, but neither hardly a step nor hardly a shorter one.
        bent = 0.5 * promised / max(promised - (found - value), 1e-300) if np.isfinite(found) else 0.1
        share *= min(max(bent, 0.1), 0.6)
    return None


def _updated(curvature: Array, moved: Array, fell: Array) -> Array:
    """Updates the curvature by BFGS, with Powell's damping, so that it stays positive."""
    bent = curvature @ moved
    size, match = float(moved @ bent), float(moved @ fell)
    if size <= 0:
        return curvature
    if match < 0.2 * size:
        share = 0.8 * size / (size - match)
        fell = share * fell + (1 - share) * bent
        match = float(moved @ fell)
    return curvature - np.outer(bent, bent) / size + np.outer(fell, fell) / match

"""Finds the smallest capsule round a cloud of points: all of them lie within its radius of its line."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial import ConvexHull, QhullError

from station.rig.arm_model import Capsule, Vector

Array = NDArray[np.float64]
_GRAIN_M = 1e-4
"""Ends are written to a tenth of a millimetre, and the radius is rounded up to one."""
_SHORTEST_M = 1e-3


def enclosing_capsule(points_m: Array) -> Capsule:
    """Returns the capsule of the least volume that holds `points_m` (n, 3), m, in their frame.

    Its line is at least 1 mm long.

    The axis is looked for from each of the cloud's principal ones, by a search over both ends.
    """
    hull = convex_corners(points_m)
    scale = float(np.ptp(hull, axis=0).max()) or _SHORTEST_M
    starts = [_along(hull, axis) for axis in _principal(hull)]
    unit = hull / scale

    def volume(ends: Array) -> float:
        return _volume(unit, ends)

    found: list[Any] = [minimize(volume, start / scale, method="Nelder-Mead", options=_OPTIONS) for start in starts]
    best = min(found, key=lambda result: float(result.fun))
    return _rounded(hull, np.asarray(best.x).reshape(2, 3) * scale)


_OPTIONS = {"xatol": 1e-4, "fatol": 1e-6, "maxfev": 3000, "adaptive": True}


def convex_corners(points: Array) -> Array:
    """Returns the corners (n, 3) of the hull of points (m, 3), m: in space, else in their plane or on their line."""
    axes = _principal(points)
    for within in (points, points @ axes[:2].T):
        try:
            return points[ConvexHull(within).vertices]
        except QhullError:  # a thin cover, or a handful of points
            continue
    along = points @ axes[0]
    return points[[along.argmin(), along.argmax()]]


def _principal(points: Array) -> Array:
    """Returns the cloud's principal axes (3, 3), one a row, by 3 × 3 numbers however long the cloud is."""
    centred = points - points.mean(axis=0)
    return np.linalg.eigh(centred.T @ centred)[1].T[::-1]


def _along(hull: Array, axis: Array) -> Array:
    """Returns the two ends (6,) of a capsule along an axis through the middle of the cloud."""
    along = hull @ axis
    across = hull - np.outer(along, axis)
    middle = (across.max(axis=0) + across.min(axis=0)) / 2
    radius = float(np.linalg.norm(across - middle, axis=1).max())
    low, high = along.min() + radius, along.max() - radius
    if low >= high:
        low = high = (low + high) / 2
    return np.concatenate([middle + low * axis, middle + high * axis])


def _radius(hull: Array, first: Array, last: Array) -> float:
    """Returns the largest distance of the points (n, 3) to the line between two ends."""
    line = last - first
    share = np.clip((hull - first) @ line / max(float(line @ line), 1e-18), 0.0, 1.0)
    away = hull - first - share[:, None] * line
    return math.sqrt(float((away * away).sum(axis=1).max()))


def _volume(hull: Array, ends: Array) -> float:
    radius = _radius(hull, ends[:3], ends[3:])
    return math.pi * radius**2 * (float(np.linalg.norm(ends[3:] - ends[:3])) + 4 / 3 * radius)


def _rounded(hull: Array, ends: Array) -> Capsule:
    first, last = np.round(ends / _GRAIN_M) * _GRAIN_M
    if np.linalg.norm(last - first) < _SHORTEST_M:
        last = first + np.array([0.0, 0.0, _SHORTEST_M])
    radius = max(math.ceil(_radius(hull, first, last) / _GRAIN_M), 1) * _GRAIN_M
    return Capsule(from_m=_vector(first), to_m=_vector(last), radius_m=round(radius, 6))


def _vector(point: Array) -> Vector:
    x, y, z = (round(value, 6) + 0.0 for value in point.tolist())
    return (x, y, z)

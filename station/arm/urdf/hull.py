"""A convex body with few corners round a cloud of points: closer to a link than a capsule, and holding all of it.

Every face lies on a face of the points' own convex hull, so nothing of them is cut off. It begins as a box. Where a
corner stands out the most, the hull's face that it stands out of is added, until none stands out by much.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError

from station.rig.arm_model import Array, Vector

_GRAIN_M = 1e-4
"""Corners are written to a tenth of a millimetre, and the faces lie that much farther out."""
_MOST_OUT_M = 2e-3
_MOST_FACES = 40
"""The largest number of faces: about 70 corners, for a link whose every face is curved."""


def enclosing_hull(points_m: Array) -> tuple[Vector, ...]:
    """Returns the corners, m, of a convex body that holds `points_m` (n, 3), m; none where they lie in one plane."""
    try:
        hull = ConvexHull(points_m)
    except (QhullError, ValueError):
        return ()
    within = points_m[hull.vertices].mean(axis=0)
    chosen, faces = _box(points_m), np.unique(hull.equations, axis=0)
    corners = _corners(chosen, within)
    while len(chosen) < _MOST_FACES:
        out = corners @ faces[:, :3].T + faces[:, 3]
        corner, face = np.unravel_index(int(out.argmax()), out.shape)
        if out[corner, face] < _MOST_OUT_M:
            break
        chosen = np.vstack([chosen, faces[face]])
        corners = _corners(chosen, within)
    return tuple(_vector(corner) for corner in np.unique(np.round(corners / _GRAIN_M), axis=0) * _GRAIN_M)


def _box(points: Array) -> Array:
    """Returns the six faces (6, 4) of the box round the points, as normals and offsets that are 0 on the face."""
    normals = np.vstack([np.eye(3), -np.eye(3)])
    return np.column_stack([normals, -(points @ normals.T).max(axis=0)])


def _corners(faces: Array, within: Array) -> Array:
    """Returns the corners (n, 3) of the body inside all faces, a grain farther out than they are."""
    return HalfspaceIntersection(faces - [0.0, 0.0, 0.0, _GRAIN_M], within).intersections


def _vector(corner: Array) -> Vector:
    x, y, z = (round(value, 6) + 0.0 for value in corner.tolist())
    return (x, y, z)

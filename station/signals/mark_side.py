"""The mark's own side as a second witness of the plate's scale: seen through the plate's map, against that printed."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from shared.geometry import Array, corners_on_plate, mark_corners
from shared.messages import CameraGeometry

IMPOSSIBLE = 0.1
"""The share of a side by which a mark may be longer or shorter on the plate's map than it is said to be. Printers that
fit a page to their paper make it 3 to 6 % shorter, a ruler tells a side of 10 mm to 1 or 2 %, and a view that was
measured by hand its own scale to some per cent. A scale that is 9 % off puts onsets off by 0.04 to 0.05 degrees, half
of what makes a sample false (`pytest -s tests/recovery/test_wrong_scale.py` prints it)."""


def contradiction(corners_px: ArrayLike, geometry: CameraGeometry) -> float:
    """Returns the largest share of its length by which a mark looks longer or shorter than printed, in any direction.

    A map that takes the mark's own corners to these has two principal stretches; both are 1 if all is right. Neither
    the mark nor the plate's map is known to be the wrong one, so that a way on the plate may be off by this share. It
    is 0 where no side, or no corner, is known, and nan where a corner is on the plate's horizon.

    Args:
        corners_px: eight numbers, or (4, 2): corners without the lens's distortion, px.
        geometry: the plate's map, and the mark's side and aspect.
    """
    seen_px = np.reshape(np.asarray(corners_px, dtype=np.float64), (-1, 2))
    if len(seen_px) != 4 or not (geometry.marker_side_m > 0.0 and geometry.marker_aspect > 0.0):
        return 0.0
    printed = mark_corners(side_m=geometry.marker_side_m, aspect=geometry.marker_aspect)
    with np.errstate(all="ignore"):
        (a, b), (c, d) = _map(printed, corners_on_plate(seen_px, geometry))
    # The principal stretches are mean ± half their difference; the mean of a mirrored mark's is none.
    mean, half = 0.5 * math.hypot(a + d, c - b), 0.5 * math.hypot(a - d, b + c)
    return abs(mean - 1.0) + half


def _map(printed: Array, seen: Array) -> list[list[float]]:
    """Returns the linear map (2, 2) from corners (4, 2) about their middle to others, by least squares."""
    stretched = (seen - seen.mean(axis=0)).T @ printed / (printed**2).sum(axis=0)
    return stretched.tolist()

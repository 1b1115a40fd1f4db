"""The way of blocks up to the foam: which corners touch it, whether it lets them go, and where they meet it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from shared.geometry import Array
from station.rig.outline import nearest_side, turn_of

Bools = NDArray[np.bool_]


def touches_round(radius_m: float, corners_m: Array, touch_m: float) -> Bools:
    """Returns true (n, 4) for `corners_m` (n, 4, 2) within `touch_m` of a circle round the middle, or beyond it."""
    return np.linalg.norm(corners_m, axis=2) > radius_m - touch_m


def way_in_round(radius_m: float, corners_m: Array, pull: Array, *, touch_m: float, lets_go: float) -> Array:
    """Returns the way (n,), m, until a corner meets the circle; 0 where foam holds a corner.

    Foam holds what touches it and is not pulled inwards by more than `lets_go`, a sine.

    Args:
        radius_m: the circle's radius, m.
        corners_m: (n, 4, 2) the blocks' corners from the middle, m.
        pull: (n, 2) unit vectors along which they slide.
        touch_m: how near to the foam a corner touches it, m.
        lets_go: the sine of the least angle inwards at which foam lets a block go.
    """
    away = np.linalg.norm(corners_m, axis=2)
    outwards = (corners_m * pull[:, None]).sum(axis=2)
    left = outwards**2 + radius_m**2 - away**2
    way = np.where(left > 0.0, np.sqrt(np.maximum(left, 0.0)) - outwards, 0.0).min(axis=1)
    held = touches_round(radius_m, corners_m, touch_m) & (outwards > -lets_go * away)
    return np.where(held.any(axis=1), 0.0, np.maximum(way, 0.0))


def touches_outline(outline_m: Array, corners_m: Array, touch_m: float) -> Bools:
    """Returns true (n,) for blocks that come within `touch_m` of an outline, or beyond it.

    Args:
        outline_m: (k, 2) the outline's corners, m.
        corners_m: (n, 4, 2) the blocks' corners, m.
        touch_m: how near to the outline a block touches it, m.
    """
    return np.array([any(room < touch_m for room, _ in _contacts(outline_m, block)) for block in corners_m], dtype=bool)


def way_in_outline(outline_m: Array, corners_m: Array, pull: Array, *, touch_m: float, lets_go: float) -> Array:
    """Returns the way (n,), m, as `way_in_round` has it, in an outline.

    Args:
        outline_m: (k, 2) the outline's corners, m.
        corners_m: (n, 4, 2) the blocks' corners, m.
        pull: (n, 2) unit vectors along which they slide.
        touch_m: how near to the outline a corner touches it, m.
        lets_go: the sine of the least angle inwards at which foam lets a block go.
    """
    ways = np.empty(len(corners_m))
    for row, (block, along) in enumerate(zip(corners_m, pull, strict=True)):
        held = any(room < touch_m and inward @ along < lets_go for room, inward in _contacts(outline_m, block))
        # The outline's corners may meet the block's sides; seen from the block they move the other way.
        free = min(_meeting(block, along, outline_m, leaving=True), _meeting(outline_m, -along, block, leaving=False))
        ways[row] = 0.0 if held else free
    return ways


def _contacts(outline_m: Array, block_m: Array) -> list[tuple[float, Array]]:
    """Returns the distance (m) and way back (2,) of each corner of a block, and of the outline from the block.

    Distances are negative beyond.
    """
    rooms, inwards = nearest_side(outline_m, block_m)
    depths, apart = nearest_side(block_m, outline_m)
    return [*zip(rooms.tolist(), inwards, strict=True), *zip((-depths).tolist(), apart, strict=True)]


def _meeting(points_m: Array, along: Array, outline_m: Array, *, leaving: bool) -> float:
    """Gives the least way (m) of points (n, 2) along a unit vector until one leaves an outline (k, 2), or enters it."""
    begin, end = outline_m, np.roll(outline_m, -1, axis=0)
    side, off = end - begin, begin[None] - points_m[:, None]
    across = along[0] * side[:, 1] - along[1] * side[:, 0]
    out = across * turn_of(outline_m)
    with np.errstate(divide="ignore", invalid="ignore"):
        way = (off[..., 0] * side[:, 1] - off[..., 1] * side[:, 0]) / across
        place = (off[..., 0] * along[1] - off[..., 1] * along[0]) / across
    met = (out > 0.0 if leaving else out < 0.0) & (way >= 0.0) & (place >= 0.0) & (place <= 1.0)
    return float(np.where(met, way, math.inf).min(initial=math.inf))

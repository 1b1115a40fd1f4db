"""The distance of places and of square blocks from a closed outline of straight sides."""

from __future__ import annotations

import numpy as np

from shared.geometry import Array


def inside_by_m(outline_m: Array, place_m: Array) -> Array:
    """Returns the distance (n,), m, of places inside an outline from its nearest side; negative outside.

    A place is inside if a ray from it crosses an odd number of sides, so the outline may be concave, and its corners
    may follow each other either way round.

    Args:
        outline_m: (k, 2) the outline's corners, m.
        place_m: (n, 2) the places, m.
    """
    return nearest_side(outline_m, place_m)[0]


def nearest_side(outline_m: Array, place_m: Array) -> tuple[Array, Array]:
    """Returns the distance `inside_by_m` (n,), m, and the unit vector (n, 2) that leads inwards from the nearest side.

    Args:
        outline_m: (k, 2) the outline's corners, m.
        place_m: (n, 2) the places, m.
    """
    begin, end = outline_m, np.roll(outline_m, -1, axis=0)
    side, off = end - begin, place_m[:, None] - begin
    share = np.clip((off * side).sum(axis=-1) / np.maximum((side * side).sum(axis=-1), 1e-18), 0.0, 1.0)
    apart = off - share[..., None] * side
    away = np.linalg.norm(apart, axis=-1)
    nearest = away.argmin(axis=1)
    row = np.arange(len(place_m))
    beside = (begin[:, 1] > place_m[:, 1:]) != (end[:, 1] > place_m[:, 1:])
    slope = side[:, 0] / np.where(side[:, 1] == 0.0, 1.0, side[:, 1])
    crossed = beside & (off[..., 0] < off[..., 1] * slope)
    sign = np.where(crossed.sum(axis=1) % 2 == 1, 1.0, -1.0)
    distance = away[row, nearest]
    # A place on a side has no direction from there; the side's own is square to it.
    square = turn_of(outline_m) * np.stack([-side[nearest, 1], side[nearest, 0]], axis=-1)
    inward = np.where(distance[:, None] > 1e-12, sign[:, None] * apart[row, nearest], square)
    return sign * distance, inward / np.maximum(np.linalg.norm(inward, axis=-1, keepdims=True), 1e-12)


def turn_of(outline_m: Array) -> float:
    """Returns 1 if the corners `outline_m` (k, 2) of an outline follow each other to the left, anticlockwise, or −1."""
    x, y = outline_m.T
    return float(np.sign((x * np.roll(y, -1) - np.roll(x, -1) * y).sum()))


def room_within(outline_m: Array, half_m: Array, pose: tuple[Array, Array, Array]) -> tuple[Array, Array]:
    """Returns the distance (n,), m, of square blocks from an outline, and the way back (n, 2).

    The distance is negative for blocks that reach beyond the outline. Two outlines are nearest where a corner of one
    meets a side of the other: the block's corners are looked at, and those of the outline, which may point into the
    opening.

    Args:
        outline_m: (k, 2) the outline's corners, m.
        half_m: (n,) half a square's side, m.
        pose: x, y (m) and yaw (rad) of the squares, each (n,).
    """
    x, y, yaw = pose
    along, aside = np.stack([np.cos(yaw), np.sin(yaw)], axis=-1), np.stack([-np.sin(yaw), np.cos(yaw)], axis=-1)
    middle = np.stack([x, y], axis=-1)
    rooms, ways = list[Array](), list[Array]()
    for u, v in ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)):
        room, way = nearest_side(outline_m, middle + half_m[:, None] * (u * along + v * aside))
        rooms.append(room)
        ways.append(way)
    for corner in outline_m:
        room, way = _from_corner(corner - middle, half_m, along, aside)
        rooms.append(room)
        ways.append(way)
    nearest, row = np.argmin(rooms, axis=0), np.arange(len(half_m))
    return np.stack(rooms)[nearest, row], np.stack(ways)[nearest, row]


def _from_corner(off_m: Array, half_m: Array, along: Array, aside: Array) -> tuple[Array, Array]:
    """Gives the distance (n,), m, of squares from a corner `off_m` (n, 2) from their middle, and the way off (n, 2)."""
    place = np.stack([(off_m * along).sum(axis=-1), (off_m * aside).sum(axis=-1)], axis=-1)
    beyond = np.abs(place) - half_m[:, None]
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=-1)
    face = beyond.argmax(axis=-1)
    row = np.arange(len(half_m))
    direction = np.where((face == 0)[:, None], along, aside)
    way = -np.sign(place[row, face])[:, None] * direction
    return np.where(outside > 0.0, outside, beyond[row, face]), way

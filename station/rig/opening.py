"""The room that a block has in the foam's opening, which is round or has straight sides, and its way to the foam."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shared.geometry import Array
from station.rig.outline import inside_by_m, room_within
from station.rig.ways import touches_outline, touches_round, way_in_outline, way_in_round

TOUCH_M = 0.001
"""A block this near to the foam touches it: some six pixels, more than a corner's error and the foam's unevenness, and
less than a block that slid free of it keeps."""
LETS_GO_RAD = math.radians(30.0)
"""Foam lets a block go that is pulled away from it by more than this angle from its side: soft foam's friction angle,
atan 0.6. Pulled less steeply away, and into the foam, a block is held, or turned aside along it. Of 1200 simulated runs
(`station run --lockstep --samples 1200 --seed 20262601`) it held 44 that seemed to slip at another friction than their
own, up to 31° of it, and none that was pulled away by 24° or more."""

Bools = NDArray[np.bool_]


def room_m(opening_m: float, half_m: Array, pose: tuple[Array, Array, Array]) -> Array:
    """Returns the distance (n,), m, of a square's outermost corner from a circle round the plate's middle.

    It is negative beyond the circle.

    Args:
        opening_m: the circle's radius, m.
        half_m: (n,) half the square's side, m.
        pose: x, y (m) and yaw (rad) of the square, each (n,).
    """
    x, y, yaw = pose
    cosine, sine = np.cos(yaw), np.sin(yaw)
    along, across = np.abs(cosine * x + sine * y), np.abs(cosine * y - sine * x)
    return opening_m - np.hypot(along + half_m, across + half_m)


@dataclass(frozen=True, kw_only=True)
class Opening:
    """The opening round the plate's middle: a circle of `radius_m` (inf: no foam), or the outline's corners (x, y)."""

    radius_m: float = math.inf
    outline_m: tuple[tuple[float, float], ...] = ()

    @property
    def walled(self) -> bool:
        """True if there is any foam."""
        return bool(self.outline_m) or math.isfinite(self.radius_m)

    @property
    def free_radius_m(self) -> float:
        """The radius of the largest circle round the plate's middle that lies in the opening, m; 0 if none does."""
        if not self.outline_m:
            return self.radius_m
        return max(float(inside_by_m(np.array(self.outline_m), np.zeros((1, 2)))[0]), 0.0)

    def room_m(self, half_m: Array, pose: tuple[Array, Array, Array]) -> Array:
        """Returns the distance (n,), m, of square blocks from the foam, negative in it; see `room_m` for the arguments.

        `half_m` (n,), m, is half a block's side.
        """
        if self.outline_m:
            return room_within(np.array(self.outline_m), half_m, pose)[0]
        return room_m(self.radius_m, half_m, pose)

    def inward(self, half_m: Array, pose: tuple[Array, Array, Array]) -> Array:
        """Returns the unit vectors (n, 2) along which the foam pushes blocks.

        They point to the middle, or square to the nearest side.

        Args:
            half_m: (n,) half a block's side, m.
            pose: x, y (m) and yaw (rad) of the blocks in the plate, each (n,).
        """
        if self.outline_m:
            return room_within(np.array(self.outline_m), half_m, pose)[1]
        away = np.stack(pose[:2], axis=-1)
        return -away / np.maximum(np.linalg.norm(away, axis=-1, keepdims=True), 1e-9)

    def touches(self, corners_m: Array) -> Bools:
        """Returns true (n,) for blocks that touch the foam or lie in it; `corners_m`: (n, 4, 2), m, in the plate."""
        if self.outline_m:
            return touches_outline(np.array(self.outline_m), corners_m, TOUCH_M)
        return np.asarray(touches_round(self.radius_m, corners_m, TOUCH_M).any(axis=1))

    def way_m(self, corners_m: Array, pull: Array) -> Array:
        """Returns how far (n,), m, blocks can slide up to the foam.

        It is 0 for a block that touches foam that does not let it go that way, and inf where there is no foam.

        Args:
            corners_m: (n, 4, 2) the blocks' corners in the plate, m.
            pull: (n, 2) unit vectors along which they slide.
        """
        if not self.walled:
            return np.full(len(corners_m), math.inf)
        limits = {"touch_m": TOUCH_M, "lets_go": math.sin(LETS_GO_RAD)}
        if self.outline_m:
            return way_in_outline(np.array(self.outline_m), corners_m, pull, **limits)
        return way_in_round(self.radius_m, corners_m, pull, **limits)


def square_corners(half_m: float, pose: tuple[float, float, float]) -> Array:
    """Returns the corners (1, 4, 2), m, of a square block at a pose x, y (m) and yaw (rad)."""
    x, y, yaw = pose
    turn = np.array([[math.cos(yaw), math.sin(yaw)], [-math.sin(yaw), math.cos(yaw)]])
    return (half_m * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) @ turn + np.array([x, y]))[None]

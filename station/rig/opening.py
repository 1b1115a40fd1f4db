"""The room that a square block has in the foam's opening, which is round or has straight sides."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from shared.geometry import Array
from station.rig.outline import inside_by_m, room_within


def room_m(opening_m: float, half_m: Array, pose: tuple[Array, Array, Array]) -> Array:
    """Distance (n,), m, of a square's outermost corner from a circle round the plate's middle, negative beyond it.

    `opening_m` is the circle's radius, `half_m` (n,) half the square's side, `pose` its x, y (m) and yaw (rad), (n,).
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
        """Distance (n,), m, of square blocks from the foam, negative in it; the arguments are those of `room_m`."""
        if self.outline_m:
            return room_within(np.array(self.outline_m), half_m, pose)[0]
        return room_m(self.radius_m, half_m, pose)

    def inward(self, half_m: Array, pose: tuple[Array, Array, Array]) -> Array:
        """The unit vectors (n, 2) along which the foam pushes blocks: to the middle, or square to the nearest side."""
        if self.outline_m:
            return room_within(np.array(self.outline_m), half_m, pose)[1]
        away = np.stack(pose[:2], axis=-1)
        return -away / np.maximum(np.linalg.norm(away, axis=-1, keepdims=True), 1e-9)

"""The sizes of a rig that evidence needs, and how far a block lies from the foam."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from station.physics.contact import Array
from station.rig.opening import Opening
from station.rig.outline import inside_by_m


@dataclass(frozen=True, eq=False, kw_only=True)
class Setting:
    """The sizes of the rig that the evidence needs, in metres.

    The foam's opening is round with `opening_radius_m` (inf: no foam), unless `opening_outline_m` has the corners (x,
    y) of its outline one after another. The camera's picture is `image_height_px` high, in pixels.
    """

    opening_radius_m: float = np.inf
    opening_outline_m: tuple[tuple[float, float], ...] = ()
    block_side_m: float = 0.01
    block_mass_kg: float = 0.008
    image_height_px: int = 600

    def free_m(self, place_m: Array) -> Array:
        """Returns the distance (n,), m, of blocks' outermost corners from the foam, at poses `place_m` (n, 3).

        Poses are x, y (m) and yaw (rad).

        At places x, y (m) in P alone, (n, 2), it is the least distance that any heading would have.
        """
        half_m = np.full(len(place_m), 0.5 * self.block_side_m)
        if place_m.shape[1] == 3:
            opening = Opening(radius_m=self.opening_radius_m, outline_m=self.opening_outline_m)
            return opening.room_m(half_m, (place_m[:, 0], place_m[:, 1], place_m[:, 2]))
        if self.opening_outline_m:
            inside_m = inside_by_m(np.array(self.opening_outline_m), place_m[:, :2])
        else:
            inside_m = self.opening_radius_m - np.hypot(place_m[:, 0], place_m[:, 1])
        return inside_m - math.sqrt(2) * half_m

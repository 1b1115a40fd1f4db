"""The little scene that every simulator's file holds: a square plate with its top at z = 0, and a cube on it.

Both frames have z up and x along the measured body's x; the plate's origin is the middle of its top, the object's the
middle of its bottom.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from station.export.measured import MeasuredPair

_PLATE_SIDES = 20.0
_PLATE_THICKNESS = 1.0


@dataclass(frozen=True, slots=True)
class Scene:
    """Sizes in metres, kg and kg m²."""

    side_m: float
    mass_kg: float
    plate_side_m: float
    plate_thickness_m: float

    @property
    def inertia_kg_m2(self) -> float:
        """The moment of inertia of a solid cube about any axis through its middle."""
        return self.mass_kg * self.side_m**2 / 6


def scene_of(pair: MeasuredPair) -> Scene:
    """Returns the scene for a pair's object; the plate is wide enough to slide on."""
    return Scene(pair.side_m, pair.mass_kg, _PLATE_SIDES * pair.side_m, _PLATE_THICKNESS * pair.side_m)


def yaw_quaternion(yaw_rad: float) -> tuple[float, float, float, float]:
    """Returns the turn about z as w, x, y, z."""
    return math.cos(yaw_rad / 2), 0.0, 0.0, math.sin(yaw_rad / 2)

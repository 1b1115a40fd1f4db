"""Offset of the pivot: the plate turns about a point other than the assumed one, and shakes the block at every step.

In the plate's frame the block feels −α × r − ω × (ω × r), r the true minus the assumed vector from the pivot to the
block: z is the height above the pivot, felt along the slope; x and y are felt along the normal.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter
from station.physics.turning import turned_push


class PivotOffset(Effect):
    """The plate turns about a point off the block."""

    id: ClassVar[str] = "pivot_offset"
    title: ClassVar[str] = "offset of the pivot"
    law: ClassVar[str] = "inertial push -alpha x r - omega x (omega x r), r = (x, y, z) from the pivot (0)"
    source: ClassVar[str] = "Landau & Lifshitz, Mechanics, section 39 (motion in a non-inertial frame)"
    layer: ClassVar[Layer] = "rig"
    family: ClassVar[Family] = "timing"
    parameters: ClassVar[tuple[Parameter, ...]] = tuple(
        Parameter(name=f"{axis}_m", symbol=axis, unit="m", low=-0.5, high=0.5, typical=0.1) for axis in "xyz"
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("arm_vibration", "kinetic_drop", "clock_offset")
    separated_by: ClassVar[str] = "slower and smoother tilt steps beside the usual ones, or an IMU on the plate"

    def push(self, contact: Contact, values: Values) -> Array | None:
        """Gives the force per mass (n, 3), m/s², by the law of this module."""
        return turned_push(contact.acceleration_rad_s2, contact.rate_rad_s, self.arm_m(values))

    def arm_m(self, values: Values) -> Array:
        """Gives the arm (3,), m, from the pivot."""
        return np.array([values["x_m"], values["y_m"], values["z_m"]])

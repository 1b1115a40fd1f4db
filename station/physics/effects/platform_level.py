"""Level: what the arm reports as level is off by a small tilt that is fixed in the world.

The true attitude is exp(ε) R, R the reported one and ε = (eps_x, eps_y, 0) a small rotation about the world's axes;
seen from the plate that is the rotation vector Rᵀ ε. R is rebuilt from the tilt and the descent as one turn about a
level axis (an arm that also turns the plate about its normal reports another P). The plate can be turned in its mount:
the level error stays, the plate's grain turns.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from shared.vectors import cross
from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter


class PlatformLevel(Effect):
    """The level plate is not level."""

    id: ClassVar[str] = "platform_level"
    title: ClassVar[str] = "level error of the platform"
    law: ClassVar[str] = "true attitude = exp(eps_x, eps_y, 0) times the reported one, in the world's axes (0, 0)"
    source: ClassVar[str] = "Dressel et al., section III.A and table I (reported against measured angles)"
    layer: ClassVar[Layer] = "rig"
    family: ClassVar[Family] = "level"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="eps_x_rad", symbol="eps_x", unit="rad", low=-0.1, high=0.1, typical=0.01),
        Parameter(name="eps_y_rad", symbol="eps_y", unit="rad", low=-0.1, high=0.1, typical=0.01),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("one_way_friction", "friction_patch")
    separated_by: ClassVar[str] = "the plate turned by 180° in its mount, or an inclinometer on the plate as it tilts"

    def attitude(self, contact: Contact, values: Values) -> Array | None:
        """Gives the plate's rotation vector (n, 3), rad, by the law of this module."""
        axis = contact.tilt_axis
        error = np.array([values["eps_x_rad"], values["eps_y_rad"], 0.0])
        cos, sin = np.cos(contact.tilt_rad)[:, None], np.sin(contact.tilt_rad)[:, None]
        return cos * error - sin * cross(axis, error) + (1.0 - cos) * (axis @ error)[:, None] * axis

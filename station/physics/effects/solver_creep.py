"""Creep of the solver: a simulator with softened contact lets a block at rest slide down, in proportion to the load.

v = k g sin θ down the slope. For MuJoCo k = (1 − d0)/d0 · dw τ / (2 n impratio), d0 and dw the first two numbers of
solimp, τ the first of solref, n the number of contacts: 2.6e-4 s with its defaults and four corners.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import GRAVITY_M_S2, Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter


class SolverCreep(Effect):
    """Softened contact slides below the critical angle."""

    id: ClassVar[str] = "solver_creep"
    title: ClassVar[str] = "creep of the solver"
    law: ClassVar[str] = "a block at rest moves down at k g sin(tilt) (k = 0)"
    source: ClassVar[str] = "Todorov 2014, ICRA, 6054 (soft contact of MuJoCo); the rate is our own measurement"
    layer: ClassVar[Layer] = "numerics"
    family: ClassVar[Family] = "numerics"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="time_s", symbol="k", unit="s", low=0.0, high=0.01, typical=1e-4),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("presliding", "camera_sag")
    separated_by: ClassVar[str] = "the simulation again with a smaller step and stiffer contact, and a slower ramp"

    def creep(self, contact: Contact, values: Values) -> Array | None:
        """Gives the velocity (n, 2), m/s, below the onset by the law of this module."""
        speed = values["time_s"] * GRAVITY_M_S2 * np.sin(contact.tilt_rad)
        return np.where(contact.moving, 0.0, speed)[:, None] * contact.down

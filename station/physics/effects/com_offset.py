"""Offset of the mass: the block's centre of mass is not over the middle of its sole.

The pressure that balances gravity, the friction at the sole and the moment of both about the mass has its centre at
s = h F / N from the point under the mass (h the mass's height, F what friction holds): it moves along the pull,
wherever the mass is over the sole. Friction that is a fixed share of the pressure acts along a line through the mass,

    s × F = (h / N) F × F = 0,

and neither turns the block nor holds it less: what the offset changes is the tilt at which the block topples, in each
direction another one (`topple`). Friction that grows more slowly than the pressure, as p^(1 − n), is spread as if the
pressure's centre were less far off the middle of the sole: it acts at −n d from the mass, to first order, which is an
`uneven_contact` with that arm. tests/unit/physics/test_contact_points.py compares this with a block on many points.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact, View
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter
from station.physics.topple import fallen

FARTHEST_M = 5e-3
CUBE = 1.0
TALLEST = 5.0


class ComOffset(Effect):
    """The centre of mass is off the middle of the sole."""

    id: ClassVar[str] = "com_offset"
    title: ClassVar[str] = "offset of the centre of mass"
    law: ClassVar[str] = "the mass is at (bx, by) in the block's frame: it topples earlier there (0, 0)"
    source: ClassVar[str] = (
        "Goyal, Ruina, Papadopoulos 1991, Wear 143, 307 (resultant of friction); Alejano et al. 2018 (toppling)"
    )
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "image"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="x_m", symbol="bx", unit="m", low=-FARTHEST_M, high=FARTHEST_M, typical=1e-3),
        Parameter(name="y_m", symbol="by", unit="m", low=-FARTHEST_M, high=FARTHEST_M, typical=1e-3),
        Parameter(name="slenderness", unit="1", low=0.1, high=TALLEST, typical=0.5, null=None, starts=(CUBE,)),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("tipping",)
    separated_by: ClassVar[str] = "tilts in all four directions up to where the block topples"

    def seen(self, view: View, values: Values) -> Array | None:
        """Returns the fall's displacement (n, 4, 2), m, less that of a block with its mass in the middle."""
        if not view.on_block:
            return None
        tall = values["slenderness"]
        off = fallen(view, slenderness=tall, offset_m=(values["x_m"], values["y_m"]))
        return off - fallen(view, slenderness=tall)

    def mass(self, contact: Contact, values: Values) -> Array | None:
        """Returns the offset (n, 3) along the sole, in widths of the sole."""
        return np.array([[values["x_m"], values["y_m"], 0.0]]) / np.sqrt(contact.area_m2)[:, None]

    def why_untestable(self, contact: Contact) -> str | None:
        """Runs that were not tilted so far that a block topples cannot show it."""
        steepest = float(np.max(contact.tilt_rad, initial=0.0))
        margin = 1.0 - 2.0 * FARTHEST_M / float(np.sqrt(np.min(contact.area_m2, initial=1.0)))
        if margin <= 0.0 or np.tan(min(steepest, 1.5)) * TALLEST > margin:
            return None
        return (
            f"No run was tilted beyond {np.degrees(steepest):.1f}°, where no block topples; "
            "a mass off the middle of its sole changes nothing else."
        )

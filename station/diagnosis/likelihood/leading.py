"""A nuisance of every block that slides: the pressure under it leads its mass, as the mass is above the sole.

A block that turns as it slides, by a sole that lies unevenly in this run, is then carried aside (`physics.sole`). Of a
second generator's nulls with uneven soles that was 40 to 80 % of the variance of the sideways force, with slopes of
.112, .079, .046 and .081 where mu h / L was .136, .089, .069 and .087.
"""

from __future__ import annotations

from typing import ClassVar

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter


class PressureLead(Effect):
    """The mass is above the sole."""

    id: ClassVar[str] = "_pressure_lead"
    title: ClassVar[str] = "pressure that leads the mass"
    law: ClassVar[str] = "a turning block is pulled across by lead L yaw rate / speed of its friction (lead = 0)"
    source: ClassVar[str] = "the balance of moments about the mass, see station.physics.sole"
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "direction law"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        # A cube's is half its friction.
        Parameter(name="lead", unit="1", low=0.0, high=0.5, typical=0.2),
    )
    separated_by: ClassVar[str] = "nothing: it is allowed for"

    def lead(self, contact: Contact, values: Values) -> Array | float:
        """Returns the lead (n,), or one for all contacts, in widths of the sole."""
        del contact
        return values["lead"]


PRESSURE_LEAD = PressureLead()

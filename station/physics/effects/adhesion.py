"""Adhesion: the surfaces attract each other, and the block is pressed on by more than its weight.

N = m g cos θ + F, so that tan θ = mu (1 + F / (m g cos θ)) at the onset; light blocks hold even upside down.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from shared.vectors import columns
from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter

SAME = 0.02
"""Masses that differ by less than this share count as one."""


class Adhesion(Effect):
    """A constant force presses the block on."""

    id: ClassVar[str] = "adhesion"
    title: ClassVar[str] = "adhesion"
    law: ClassVar[str] = "extra normal force F (F = 0)"
    source: ClassVar[str] = "Derjaguin 1934, Z. Phys. 88, 661; Johnson, Kendall, Roberts 1971, Proc. R. Soc. A 324, 301"
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "load"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="force_n", symbol="F", unit="N", low=0.0, high=2.0, typical=0.02),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("load_dependence", "angle_scale")
    separated_by: ClassVar[str] = "masses over a range of ten to one in random order, and several tilts while sliding"
    absorbed_by_mu: ClassVar[bool] = True

    def push(self, contact: Contact, values: Values) -> Array | None:
        """Gives the force per mass (n, 3), m/s², by the law of this module."""
        pressed, none = -values["force_n"] / contact.mass_kg, np.zeros(len(contact))
        return columns(none, none, pressed)

    def why_untestable(self, contact: Contact) -> str | None:
        """Runs with one mass cannot show it: an extra normal force is then another mu."""
        if np.ptp(contact.mass_kg) > SAME * np.mean(contact.mass_kg):
            return None
        return "All runs have one mass, and then an extra normal force is the same as a larger mu; add a second mass."

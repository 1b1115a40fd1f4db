"""Contact ageing: real contact area grows with the logarithm of the time under load, and static friction with it.

mu_s(t) = mu_s (1 + b log10((t + 0.1 s) / t1)), t the time at rest, while b is small. Where it is not, the line may go
through mu_s itself or through its logarithm, which makes it a power of the time: (1 + c b log10(…))^(1/c) has both,
c = 1 and c = 0. Only the static coefficient ages: sliding renews the contact. A contact that has rested for about t1
is as strong as a sliding one, whose asperities live for a memory length over the speed; with t1 = 0.1 s a fresh contact
is.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter

CUT_OFF_S = 0.1
STRAIGHTEST = 1e-6
"""The smallest c; at 0 the law is a power of the time."""

LEAST = 0.05
"""The least factor on friction, for a contact so young that the line would lead to nothing."""


class ContactAging(Effect):
    """Static friction grows with the time at rest."""

    id: ClassVar[str] = "contact_aging"
    title: ClassVar[str] = "contact ageing"
    law: ClassVar[str] = "mu_s grows by b per decade of time at rest (b = 0), and is the sliding one at t1"
    source: ClassVar[str] = (
        "Dieterich 1979, JGR 84, 2161 (the age of a sliding contact); Dillavou & Rubinstein 2018, PRL 120, 224101; "
        "Frye & Marone 2002, JGR 107; powers of the time: Brockley & Davis 1968, J. Lubr. Technol. 90, 35"
    )
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "history"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="per_decade", symbol="b", unit="1", low=0.0, high=0.3, typical=0.03),
        Parameter(
            name="sliding_age_log10_s",
            symbol="log10 t1",
            unit="log10 s",
            low=-1.2,
            high=0.3,
            typical=0.3,
            null=None,
            starts=(-1.0, 0.0),
        ),
        Parameter(name="curve", unit="1", low=0.0, high=1.0, typical=0.5, null=None, starts=(1.0,)),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("wear", "kinetic_drop", "clock_offset")
    separated_by: ClassVar[str] = "dwell drawn at random from 1 to 100 s at a fixed tilt rate"

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """Gives the factor (n,) on friction by the law of this module."""
        decades = np.log10(contact.rest_s + CUT_OFF_S) - values["sliding_age_log10_s"]
        grown = values["per_decade"] * decades
        curve = max(values["curve"], STRAIGHTEST)
        return np.where(contact.moving, 1.0, np.maximum(1.0 + curve * grown, LEAST) ** (1.0 / curve))

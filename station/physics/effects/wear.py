"""Wear: friction changes with the number of runs and settles.

m(n) = 1 − f (1 − exp(−n / n0)), n the run's number in the session. A fall (f > 0) is what wear, polishing and a lost
coating do; a rise (f < 0) is roughening, or dust. With n0 far beyond the session it is a steady drift.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter


class Wear(Effect):
    """Friction drifts over the session."""

    id: ClassVar[str] = "wear"
    title: ClassVar[str] = "wear, or a drift over the session"
    law: ClassVar[str] = "mu falls by the share f (1 - exp(-run / n0)) (f = 0)"
    source: ClassVar[str] = "Archard 1953, J. Appl. Phys. 24, 981; Blau 2005, Tribol. Int. 38, 1007 (running in)"
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "drift"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="fall", symbol="f", unit="1", low=-0.4, high=0.6, typical=0.1),
        Parameter(
            name="runs",
            symbol="n0",
            unit="1",
            low=1.0,
            high=1000.0,
            typical=50.0,
            null=None,
            starts=(50.0, 10.0, 300.0),
        ),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("contact_aging",)
    separated_by: ClassVar[str] = "a return to one reference direction every few runs, with dwell drawn at random"
    demonstrated: ClassVar[Values] = {"fall": 0.3}

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """Gives the factor (n,) on friction by the law of this module."""
        return 1.0 + values["fall"] * np.expm1(-contact.run / values["runs"])

    def derived(self, contact: Contact, values: Values) -> Mapping[str, tuple[float, str]]:
        """Returns how much friction changes over the session, which the fall and its runs share."""
        first, last = np.argmin(contact.run), np.argmax(contact.run)
        friction = 1.0 + values["fall"] * np.expm1(-contact.run[[first, last]] / values["runs"])
        return {"change of friction from the first to the last run": (float(friction[1] / friction[0] - 1.0), "1")}

    def why_untestable(self, contact: Contact) -> str | None:
        """Runs whose order is unknown cannot show it."""
        if len(contact) and np.ptp(contact.run) > 0:
            return None
        return "The order of the runs is unknown; add their numbers or times."

"""Friction that was measured by pulling, on a tribometer or a block that slides steadily: a coefficient at a load."""

from __future__ import annotations

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.observations.channel import ALONG, ONSET, Channel, Rows
from station.physics.contact import GRAVITY_M_S2, Array, Contact
from station.physics.model import Model

SETTLING = "settling"
TITLES = {
    ONSET: "the friction at the onset",
    ALONG: "the friction along the slide",
    SETTLING: "the friction that settles after a change of the speed",
}

LEAST_SHARE = 0.05
"""The smallest share of the press and of the friction that a model's pushes leave: a logarithm needs some."""


class Pulled(Channel):
    """Log of the recorded coefficient of friction less that of the model's, at loads that the apparatus sets.

    The contact lies level with the mass that its load would have; the model's pushes add to the load and to the pull.
    """

    unit: str = "relative friction"
    trusted: float = thresholds.FRICTION_TRUSTED

    def __init__(
        self, name: str, rows: Rows, contact: Contact, coefficient: Array, *, travelled_m: Array | None = None
    ) -> None:
        """Has the rows' contacts and coefficients (n,).

        They are named 'along' while they slide, 'settling' until friction has settled after a change of the speed, and
        'onset' at the end of their rest.
        """
        super().__init__(rows)
        self.name, self.phase = name, "onset" if name == ONSET else "slide"
        self.title, self.level_tells = TITLES[name], name == SETTLING
        self.shares_friction = self.frictional = not self.level_tells
        self.travelled_m = travelled_m
        self._contact, self._log_recorded = contact, np.log(coefficient)

    @property
    def hooks(self) -> frozenset[str]:
        """Friction and pushes: no plate is tilted, and no camera looks."""
        return frozenset({"friction", "push"})

    @property
    def contact(self) -> Contact:
        """The recorded contacts (n,)."""
        return self._contact

    def residual(self, model: Model) -> Array:
        """Returns the log of recorded over predicted friction (n,)."""
        contact = self._contact
        push = model.push(contact)
        press = np.maximum(1.0 - push[:, 2] / GRAVITY_M_S2, LEAST_SHARE)
        held = press * model.friction(contact)
        dragged = (push[:, :2] * contact.way).sum(axis=1) / GRAVITY_M_S2
        return self._log_recorded - np.log(np.maximum(held - dragged, LEAST_SHARE * held))

"""Backlash: the plate lags behind the reported angle, on the side from which it comes.

True tilt = reported − w while rising, reported + w while falling, w half the play. When the tilt turns round the plate
stays where it is until the whole play is taken up: with d the angle that the report has gone since, it lags by d − w
until that is w. Swings before which were smaller than the whole play took up none of it (a play operator;
Krasnosel'skii & Pokrovskii 1989, Systems with Hysteresis).
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter


class Backlash(Effect):
    """The angle lags on reversal."""

    id: ClassVar[str] = "backlash"
    title: ClassVar[str] = "backlash"
    law: ClassVar[str] = "true tilt = reported - w while rising, + w while falling, and waits at each turn (w = 0)"
    source: ClassVar[str] = "Nordin & Gutman 2002, Automatica 38, 1633 (friction-driven hysteresis)"
    layer: ClassVar[Layer] = "rig"
    family: ClassVar[Family] = "level"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="half_width_rad", unit="rad", low=0.0, high=0.02, typical=0.003),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("angle_scale", "clock_offset")
    separated_by: ClassVar[str] = "angles approached from above as well as from below"
    absorbed_by_mu: ClassVar[bool] = True

    def attitude(self, contact: Contact, values: Values) -> Array | None:
        """Gives the plate's rotation vector (n, 3), rad, by the law of this module."""
        half = values["half_width_rad"]
        behind: Array | float = -half
        for swing in contact.swing_rad.T[::-1]:
            behind = -np.minimum(behind + swing, half)
        behind = contact.rising * np.minimum(behind + contact.gone_rad, half)
        return -behind[:, None] * contact.tilt_axis

    def why_untestable(self, contact: Contact) -> str | None:
        """Returns the reason if all slides began with the tilt moving the same way: play is then another mu."""
        if len(contact) and np.ptp(contact.rising) > 0:
            return None
        return "Every slide began with the tilt moving the same way, so play is the same as another mu; add reversals."

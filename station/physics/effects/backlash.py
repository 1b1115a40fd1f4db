"""Backlash: the plate lags behind the reported angle, on the side from which it comes.

True tilt = reported − w while rising, reported + w while falling, w half the play. When the tilt turns round the plate
stays where it is until the whole play is taken up: with d the angle that the report has gone since, it lags by d − w
until that is w. Then it takes up the arm's rate, which shakes the block. Swings before which were smaller than the
whole play took up none of it (a play operator; Krasnosel'skii & Pokrovskii 1989, Systems with Hysteresis).
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter

TAKEN_UP = 0.3
"""The part of the play in which the plate takes up the arm's rate, once that is gone.

It is 15 ms of a swift return with one degree of play: half a swing of a wrist that rings at 30 Hz. Half or twice as
much changes a window's mean acceleration by 7 or 11 % of the greatest (`pytest -s tests/unit/diagnosis/test_finer.py -k
taken_up` prints it).
"""
LEAST_RAD = 1e-9
"""A guard of the division by the play."""


class Backlash(Effect):
    """The angle lags on reversal."""

    id: ClassVar[str] = "backlash"
    title: ClassVar[str] = "backlash"
    law: ClassVar[str] = "true tilt = reported - w while rising, + w while falling, and waits at each turn (w = 0)"
    source: ClassVar[str] = "Nordin & Gutman 2002, Automatica 38, 1633 (friction-driven hysteresis)"
    layer: ClassVar[Layer] = "rig"
    family: ClassVar[Family] = "level"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="half_width_rad", symbol="w", unit="rad", low=0.0, high=0.02, typical=0.003),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("angle_scale", "clock_offset")
    separated_by: ClassVar[str] = "angles approached from above as well as from below"
    absorbed_by_mu: ClassVar[bool] = True

    def attitude(self, contact: Contact, values: Values) -> Array | None:
        """Gives the plate's rotation vector (n, 3), rad, by the law of this module."""
        half = values["half_width_rad"]
        left = self._play_rad(contact, half) - contact.gone_rad
        behind = contact.rising * (half - np.maximum(left, 0.0))
        return -behind[:, None] * contact.tilt_axis

    def motion(self, contact: Contact, values: Values) -> Array | None:
        """Gives the change (n, 2, 3) of rate and acceleration: the plate waits, and then takes up what is reported."""
        rate, play = contact.rate_rad_s, self._play_rad(contact, values["half_width_rad"])
        length = TAKEN_UP * play + LEAST_RAD
        gone = np.clip((contact.gone_rad - play + LEAST_RAD) / length, 0.0, 1.0)
        tilting = np.abs((rate * contact.tilt_axis).sum(axis=1))
        missing, gained = 1.0 - gone**2 * (3.0 - 2.0 * gone), 6.0 * gone * (1.0 - gone) * tilting / length
        speeding = gained[:, None] * rate - missing[:, None] * contact.acceleration_rad_s2
        return np.stack([-missing[:, None] * rate, speeding], axis=1)

    def _play_rad(self, contact: Contact, half: float) -> Array:
        """Returns the play (n,), rad, that the last turn left to be taken up: 2 w, or less after small swings."""
        behind: Array = np.full(len(contact), -half)
        for swing in contact.swing_rad.T[::-1]:
            behind = -np.minimum(behind + swing, half)
        return half - behind

    def why_untestable(self, contact: Contact) -> str | None:
        """Returns the reason if all slides began with the tilt moving the same way: play is then another mu."""
        if len(contact) and np.ptp(contact.rising) > 0:
            return None
        return "Every slide began with the tilt moving the same way, so play is the same as another mu; add reversals."

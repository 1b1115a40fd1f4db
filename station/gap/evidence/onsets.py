"""The onset channel: at what load each run slid, against what the model says that it holds."""

from __future__ import annotations

import numpy as np

from station.gap.evidence.channel import Channel, Rows
from station.gap.evidence.moments import Moments
from station.physics.contact import Array
from station.physics.dissipation import threshold
from station.physics.model import Model


class Onsets(Channel):
    """ln(T/N) at the onset less ln of the model's threshold: relative friction; a limit for runs without a slide."""

    name: str = "onset"
    phase: str = "onset"
    unit: str = "relative friction"
    shares_friction: bool = True

    def __init__(self, rows: Rows, moments: Moments) -> None:
        super().__init__(rows)
        self.moments = moments

    def residual(self, model: Model) -> Array:
        """See the class."""
        load = self.moments.loads(model)
        size = np.hypot(load.tangential[:, 0], load.tangential[:, 1])
        toward = np.arctan2(load.tangential[:, 1], load.tangential[:, 0])
        held, _ = threshold(model, load.contact, toward)
        return np.log(np.maximum(size / load.normal, 1e-6)) - np.log(np.maximum(held, 1e-6))

    def shaking(self, model: Model) -> Array:
        """Standard deviation (n,) of the residual by the model's random pushes."""
        contact = self.moments.reported
        return model.shaking(contact) / np.maximum(9.81 * np.sin(contact.tilt_rad), 1e-3)

    def angle_rad(self) -> Array:
        """The recorded onset tilts (n,)."""
        return self.moments.reported.tilt_rad

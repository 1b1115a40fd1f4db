"""The onset channel: at what load each run slid, against what the model says that it holds."""

from __future__ import annotations

import numpy as np

from station.gap.evidence.channel import Channel, Rows
from station.gap.evidence.moments import Moments
from station.physics.contact import Array
from station.physics.dissipation import threshold
from station.physics.model import Model

MOST_DRAWN = 1.0
"""No run's friction is more than e times the model's, or less: an onset that says so was knocked off."""


class Onsets(Channel):
    """ln(T/N) at the onset less ln of the model's threshold: relative friction; a limit for runs without a slide."""

    name: str = "onset"
    phase: str = "onset"
    unit: str = "relative friction"
    shares_friction: bool = True

    def __init__(self, rows: Rows, moments: Moments) -> None:
        super().__init__(rows)
        self.moments = moments
        self._last: tuple[Model, Array] | None = None

    def residual(self, model: Model) -> Array:
        """See the class."""
        # Slides ask again for the model that was just asked for.
        if self._last is None or self._last[0] is not model:
            self._last = (model, self._residual(model))
        return self._last[1]

    def drawn(self, model: Model, runs: int) -> Array:
        """Each run's (r,) own ln of friction over the model's, as its onset tells; 0 where there is none."""
        found = np.zeros(runs)
        known = ~self.rows.limit
        found[self.rows.run[known]] = np.clip(self.residual(model)[known], -MOST_DRAWN, MOST_DRAWN)
        return found

    def _residual(self, model: Model) -> Array:
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

"""The onset channel: at what load each run slid, against what the model says that it holds."""

from __future__ import annotations

import numpy as np

from station.gap.evidence.channel import Channel, Rows
from station.gap.evidence.moments import Load, Moments
from station.physics.contact import Array
from station.physics.dissipation import threshold
from station.physics.model import Model

PLAIN = Model(mu_s=1.0)
"""Changes neither attitude nor clock and pushes nothing."""

LEAST_M_S2 = 1e-6
MOST_DRAWN = 1.0
"""No run's friction is more than e times the model's, or less: an onset that says so was knocked off."""


class Onsets(Channel):
    """ln of the pull at the onset less ln of what the model says it is: relative friction; a limit without a slide.

    The pull is the reported one. What a model adds to it stands on the model's side, as with the slides: else a run's
    own friction would be in the slope by the model, and a law of the level be fitted to the scatter.
    """

    name: str = "onset"
    phase: str = "onset"
    unit: str = "relative friction"
    shares_friction: bool = True

    def __init__(self, rows: Rows, moments: Moments) -> None:
        super().__init__(rows)
        self.moments = moments.expecting(float(np.median(moments.reported.tilt_rad)))
        self._pull = _size(moments.loads(PLAIN))
        self._last: tuple[Model, Array, Array] | None = None

    def residual(self, model: Model) -> Array:
        """See the class."""
        return self._of(model)[0]

    def drawn(self, model: Model, runs: int) -> tuple[Array, Array]:
        """Each run's (r,) own ln of friction over the model's, as its onset tells, and its residual; else 0."""
        residual, drawn = self._of(model)
        known = ~self.rows.limit
        found = np.zeros((2, runs))
        found[0, self.rows.run[known]] = np.clip(drawn[known], -MOST_DRAWN, MOST_DRAWN)
        found[1, self.rows.run[known]] = residual[known]
        return found[0], found[1]

    def _of(self, model: Model) -> tuple[Array, Array]:
        """The residual, and ln of the friction over the model's (n,); slides ask again for the last model."""
        if self._last is None or self._last[0] is not model:
            load = self.moments.loads(model)
            size = _size(load)
            toward = np.arctan2(load.tangential[:, 1], load.tangential[:, 0])
            held, _ = threshold(model, load.contact, toward)
            held = np.maximum(load.normal * held, LEAST_M_S2)
            added = size - self._pull
            expected = np.maximum(held - added, 0.05 * held)
            self._last = (model, np.log(self._pull / expected), np.log(np.maximum(size, LEAST_M_S2) / held))
        return self._last[1], self._last[2]

    def shaking(self, model: Model) -> Array:
        """Standard deviation (n,) of the residual by the model's random pushes."""
        contact = self.moments.reported
        return model.shaking(contact) / np.maximum(9.81 * np.sin(contact.tilt_rad), 1e-3)

    def angle_rad(self) -> Array:
        """The recorded onset tilts (n,)."""
        return self.moments.reported.tilt_rad


def _size(load: Load) -> Array:
    return np.maximum(np.hypot(load.tangential[:, 0], load.tangential[:, 1]), LEAST_M_S2)

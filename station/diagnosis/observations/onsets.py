"""The onset channel: at what load each run slid, against what the model says that it holds."""

from __future__ import annotations

import math

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.observations.channel import Channel, Rows
from station.diagnosis.observations.moments import Load, Moments
from station.physics.contact import Array
from station.physics.dissipation import held_along, threshold
from station.physics.model import Model

LEAST_M_S2 = 1e-6
LEAST_TILT_RAD, MOST_TILT_RAD = 0.02, 1.4
"""Within these a tilt is expected."""

MOST_DRAWN = math.log(math.tan(MOST_TILT_RAD) / math.tan(LEAST_TILT_RAD))
"""ln of friction over the model's: no tilt tells of more. It only keeps a model that is far off from overflowing. A
bound that a run can reach puts a kink into the likelihood: at 1 one run in a hundred sat on it, and no fit converged
(`pytest tests/recovery/test_rig_as_it_comes.py -k 40109`)."""


class Onsets(Channel):
    """ln of the pull over the pressing at the onset, less ln of what the model expects; a limit without a slide.

    What the model expects it says at the tilt that it expects, not at the recorded one. That is what the run's own
    friction made of it: a law that falls with the load, which falls with the tilt, would be fitted to the scatter. So
    would one of the time at rest, which goes on while the plate tilts.
    """

    name: str = "onset"
    phase: str = "onset"
    unit: str = "relative friction"
    shares_friction: bool = True
    trusted: float = thresholds.FRICTION_TRUSTED

    def __init__(self, rows: Rows, moments: Moments) -> None:
        super().__init__(rows)
        self.moments = moments
        self._typical = _Expected(moments.tilted(float(np.median(moments.reported.tilt_rad))))
        self._recorded = moments.tilted(moments.reported.tilt_rad)
        plain = moments.plain
        self._log_recorded = np.log(_size(plain) / plain.normal)
        self._last: tuple[Model, Array] | None = None
        self._last_drawn: tuple[Model, Array] | None = None
        self._typically, self._expecting, self._recording = self._ways = (_Way(), _Way(), _Way())

    def near(self, model: Model | None) -> None:
        """See `Channel.near`: blocks take the ways that this model's blocks take."""
        for way in self._ways:
            way.kept = False
        if model is None:
            return
        if any(way.of is not model for way in self._ways):
            self._last = self._last_drawn = None
            self.residual(model)
            self._own(model)
        for way in self._ways:
            way.kept = True

    def residual(self, model: Model) -> Array:
        """See the class; slides ask again for the last model."""
        if self._last is None or self._last[0] is not model:
            ratio = self._typical.friction(model, self._typically)
            steep = np.clip(np.arctan(ratio), LEAST_TILT_RAD, MOST_TILT_RAD)
            expected = _Expected(self.moments.tilted(steep)).friction(model, self._expecting)
            self._last = (model, self._log_recorded - np.log(expected))
        return self._last[1]

    def drawn(self, model: Model, runs: int) -> tuple[Array, Array]:
        """Each run's (r,) own ln of friction over the model's, as its onset tells, and its residual; else 0."""
        known = ~self.rows.limit
        found = np.zeros((2, runs))
        found[0, self.rows.run[known]] = self._own(model)[known]
        found[1, self.rows.run[known]] = self.residual(model)[known]
        return found[0], found[1]

    def _own(self, model: Model) -> Array:
        if self._last_drawn is None or self._last_drawn[0] is not model:
            load, held = self._recording.held(self._recorded, model)
            self._last_drawn = (model, np.clip(np.log(_size(load) / held), -MOST_DRAWN, MOST_DRAWN))
        return self._last_drawn[1]

    def shaking(self, model: Model) -> Array:
        """Standard deviation (n,) of the residual by the model's random pushes."""
        contact = self.moments.reported
        return model.shaking(contact) / np.maximum(9.81 * np.sin(contact.tilt_rad), 1e-3)

    def angle_rad(self) -> Array:
        """The recorded onset tilts (n,)."""
        return self.moments.reported.tilt_rad


def _size(load: Load) -> Array:
    return np.maximum(np.hypot(load.tangential[:, 0], load.tangential[:, 1]), LEAST_M_S2)


class _Way:
    """The directions (n,) in which a model's blocks slip at some moments: sought for each model, or `kept`.

    `of` is the model for which they were sought.
    """

    def __init__(self) -> None:
        self.kept = False
        self.of: Model | None = None
        self._last_rad: Array = np.zeros(0)

    def held(self, moments: Moments, model: Model) -> tuple[Load, Array]:
        """The loads that a model sees, and the friction (n,), per mass, that it lets the block have against them."""
        load = moments.loads(model)
        toward = np.arctan2(load.tangential[:, 1], load.tangential[:, 0])
        if self.kept:
            held = held_along(model, load.contact, toward, self._last_rad)
        else:
            held, self._last_rad = threshold(model, load.contact, toward)
            self.of = model
        return load, np.maximum(load.normal * held, LEAST_M_S2)


class _Expected:
    """The pull over the pressing, both as reported (n,), at which a model's blocks slip: near the moments' tilts."""

    def __init__(self, moments: Moments) -> None:
        plain = moments.plain
        self._moments, self._pull, self._normal = moments, _size(plain), plain.normal

    def friction(self, model: Model, way: _Way) -> Array:
        """See the class."""
        load, held = way.held(self._moments, model)
        added = _size(load) - self._pull
        return np.maximum(held - added, 0.05 * held) / self._normal

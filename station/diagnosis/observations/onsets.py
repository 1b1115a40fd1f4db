"""The onset channel: the load at which each run slid, against the one that the model holds."""

from __future__ import annotations

import math

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.observations.channel import ONSET, Channel, Rows
from station.diagnosis.observations.moments import Load, Moments
from station.diagnosis.observations.released import Released
from station.diagnosis.observations.slow_slides import SlowSlides
from station.physics.contact import Array, Contact
from station.physics.dissipation import held_along, threshold
from station.physics.model import Model

LEAST_M_S2 = 1e-6
LEAST_TILT_RAD, MOST_TILT_RAD = 0.02, 1.4
"""The bounds of an expected onset's tilt."""

MOST_RUN_EFFECT = math.log(math.tan(MOST_TILT_RAD) / math.tan(LEAST_TILT_RAD))
"""The bound of a run's log friction over the model's: no two tilts lie farther apart. It keeps a model that is far off
from overflowing. A bound that a run can reach puts a kink into the likelihood: at 1 one run in a hundred sat on it,
and no fit converged (`pytest tests/recovery/test_rig_as_it_comes.py`)."""


class Onsets(Channel):
    """Log of pull over press at the onset, less the log of what the model expects; a lower limit without a slide.

    The model's expectation is taken at the tilt at which it expects the onset, not at the recorded one, which the run's
    own friction has caused: a law that falls with the load, which falls with the tilt, would be fitted to the scatter.
    So would a law of the time at rest, which goes on while the plate tilts.

    What a model pushes in time with the plate's motion changes the recorded friction of the slips that were re-read,
    and a block that slid slowly before its slip had the friction of that speed.
    """

    name: str = ONSET
    title: str = "the friction at the onset"
    phase: str = "onset"
    unit: str = "relative friction"
    shares_friction: bool = True
    frictional: bool = True
    trusted: float = thresholds.FRICTION_TRUSTED

    def __init__(
        self, rows: Rows, moments: Moments, released: Released | None = None, slow: SlowSlides | None = None
    ) -> None:
        super().__init__(rows)
        self.moments, self._released, self._slow = moments, released, slow
        self._typical = _Expected(moments.tilted(float(np.median(moments.reported.tilt_rad))))
        self._recorded = moments.tilted(moments.reported.tilt_rad)
        plain = moments.plain
        self._log_recorded = np.log(_size(plain) / plain.normal)
        self._last: tuple[Model, Array] | None = None
        self._last_run_effect: tuple[Model, Array] | None = None
        self._typically, self._expecting, self._recording = self._ways = (_Way(), _Way(), _Way())

    @property
    def contact(self) -> Contact:
        """The recorded contacts (n,)."""
        return self.moments.reported

    def near(self, model: Model | None) -> None:
        """Keeps the directions in which this model's blocks slip, see `Channel.near`."""
        for way in self._ways:
            way.kept = False
        if model is None:
            return
        if any(way.of is not model for way in self._ways):
            self._last = self._last_run_effect = None
            self.residual(model)
            self._own(model)
        for way in self._ways:
            way.kept = True

    def residual(self, model: Model) -> Array:
        """Returns the log of recorded over expected friction (n,), cached for the last model, as slides ask again."""
        if self._last is None or self._last[0] is not model:
            ratio = self._typical.friction(model, self._typically)
            steep = np.clip(np.arctan(ratio), LEAST_TILT_RAD, MOST_TILT_RAD)
            expected = _Expected(self.moments.tilted(steep)).friction(model, self._expecting)
            self._last = (model, self._log_recorded + self._log_moved(model) - np.log(expected))
        return self._last[1]

    def run_effects(self, model: Model, runs: int) -> tuple[Array, Array]:
        """Returns each run's (r,) own log friction over the model's by its onset, and the onset's residual.

        Both are 0 where unknown.
        """
        known = ~self.rows.limit
        found = np.zeros((2, runs))
        found[0, self.rows.run[known]] = self._own(model)[known]
        found[1, self.rows.run[known]] = self.residual(model)[known]
        return found[0], found[1]

    def _own(self, model: Model) -> Array:
        if self._last_run_effect is None or self._last_run_effect[0] is not model:
            load, held = self._recording.held(self._recorded, model)
            own = np.log(_size(load) / held) + self._log_moved(model)
            self._last_run_effect = (model, np.clip(own, -MOST_RUN_EFFECT, MOST_RUN_EFFECT))
        return self._last_run_effect[1]

    def _log_moved(self, model: Model) -> Array | float:
        """Returns what the log friction (n,) of an onset is above the recorded one of a block at rest."""
        moved = 0.0 if self._released is None else self._released.log_moved(model)
        return moved if self._slow is None else moved - self._slow.log_grown_of(model, self.rows.run)

    def shaking(self, model: Model) -> Array:
        """Returns the standard deviation (n,) of the residual by the model's random pushes."""
        contact = self.moments.reported
        return model.shaking(contact) / np.maximum(9.81 * np.sin(contact.tilt_rad), 1e-3)

    def angle_rad(self) -> Array:
        """Returns the recorded onset tilts (n,)."""
        return self.moments.reported.tilt_rad


def _size(load: Load) -> Array:
    return np.maximum(np.hypot(load.tangential[:, 0], load.tangential[:, 1]), LEAST_M_S2)


class _Way:
    """The directions (n,) in which a model's blocks slip: sought for each model, unless they are `kept`.

    `of` is the model for which they were sought.
    """

    def __init__(self) -> None:
        self.kept = False
        self.of: Model | None = None
        self._last_rad: Array = np.zeros(0)

    def held(self, moments: Moments, model: Model) -> tuple[Load, Array]:
        """Returns the loads under a model, and the friction per mass (n,), m/s², that opposes them."""
        load = moments.loads(model)
        toward = np.arctan2(load.tangential[:, 1], load.tangential[:, 0])
        if self.kept:
            held = held_along(model, load.contact, toward, self._last_rad)
        else:
            held, self._last_rad = threshold(model, load.contact, toward)
            self.of = model
        return load, np.maximum(load.normal * held, LEAST_M_S2)


class _Expected:
    """The ratio of reported pull to press (n,) at which a model's blocks slip, linearised at the moments' tilts."""

    def __init__(self, moments: Moments) -> None:
        plain = moments.plain
        self._moments, self._pull, self._normal = moments, _size(plain), plain.normal

    def friction(self, model: Model, way: _Way) -> Array:
        """Returns the ratio (n,) at which the model's blocks slip."""
        load, held = way.held(self._moments, model)
        added = _size(load) - self._pull
        return np.maximum(held - added, 0.05 * held) / self._normal

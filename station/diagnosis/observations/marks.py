"""The image channels: the apparent motion of block and plate before the slide."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.observations.channel import REST, Channel, Rows
from station.diagnosis.observations.moments import Latest, Moments
from station.diagnosis.observations.slow_slides import HOLDING, Before, SlowSlides
from station.physics.contact import Array, View, middle
from station.physics.model import Model

CREEP_POINTS = 49
"""Most of a shaking arm's creep falls into the last tenth of the way to the slip."""


class PlateMarks(Channel):
    """The apparent motion of the plate's own fiducials down the slope, m, at the block mark's height.

    `view` and `start` see the mark in each stretch of the tilt (n,) and level before the tilt (n,). It lies where it
    lay: what it seems to have moved is what a model predicts, and no place from which to predict. Beside a lens of 4 %
    a camera's sag was 14 % too small, and the blocks seemed to creep.
    """

    name: str = "plate"
    title: str = "the place of the plate's own marks"
    phase: str = "pre-slip"
    unit: str = "m"
    level_tells: bool = True
    trusted: float = thresholds.PLACE_TRUSTED_M

    def __init__(self, rows: Rows, moved_m: Array, view: View, start: View) -> None:
        super().__init__(rows)
        self._moved, self._view, self._start = moved_m, view.of(start.point_m), start

    def residual(self, model: Model) -> Array:
        """Returns recorded minus predicted apparent motion (n,), m."""
        return self._moved - (self._predicted(model) * self._view.down).sum(axis=1)

    def _predicted(self, model: Model) -> Array:
        """Returns the predicted apparent motion (n, 2), m."""
        return middle(model.seen(self._view) - model.seen(self._start))


class Mount(Channel):
    """The place of the plate's own fiducials along an axis of P, m, less the session's mean; the plate is level.

    Whatever shifts the picture of a level plate does so alike in all runs: only a camera's mount that gives way changes
    it. `mount_rad` (n,) is the turn of the plate in its own mount: each has a mean of its own, as its marks stand
    elsewhere.
    """

    phase: str = "camera at rest"
    unit: str = "m"
    trusted: float = thresholds.PLACE_TRUSTED_M

    def __init__(self, rows: Rows, axis: str, place_m: Array, mount_rad: Array) -> None:
        super().__init__(rows)
        self.name, self.title = f"mount:{axis}", f"the place of the plate's own marks along {axis}, level,"
        _, mount = np.unique(mount_rad, return_inverse=True)
        self._apart = place_m - (np.bincount(mount, place_m) / np.bincount(mount))[mount]

    def residual(self, model: Model) -> Array:
        """Returns the places (n,), m, which no model changes."""
        del model
        return self._apart


class Rest(PlateMarks):
    """The block's mean apparent motion down the slope before its onset, m, in stretches of the tilt.

    `creeping` has CREEP_POINTS moments for each row, and `creep_s` (n, CREEP_POINTS) is for how long each one's creep
    counts in the stretch's mean motion; `limit_rad` (CREEP_POINTS n,) is the tilt at which the run's block slid.
    """

    name: str = REST
    title: str = "the block's place before the slip"

    def __init__(
        self,
        rows: Rows,
        moved_m: Array,
        *,
        view: View,
        start: View,
        creeping: Moments,
        creep_s: Array,
        limit_rad: Array,
        slow: SlowSlides | None = None,
    ) -> None:
        super().__init__(rows, moved_m, view, start)
        resting = creeping.reported
        holds = np.tan(limit_rad) * resting.pressing_m_s2
        self._resting, self._creep_s = replace(resting, spare_m_s2=holds - resting.pulling_m_s2), creep_s
        self._crept = Latest(self._crept_under, ("creep",))
        self._slid: Latest[Array] | None = None
        if slow is not None:
            before = slow.before(rows.run, resting.tilt_rad.reshape(-1, CREEP_POINTS))
            self._slid = Latest(partial(self._slid_slowly, before), HOLDING)

    def _predicted(self, model: Model) -> Array:
        moved = super()._predicted(model)
        if model.acting("creep"):
            moved = moved + self._crept(model)
        return moved if self._slid is None else moved + self._slid(model)

    def _crept_under(self, model: Model) -> Array:
        """Returns the creep's part of the predicted motion (n, 2), m."""
        velocity = model.creep(self._resting).reshape(len(self), CREEP_POINTS, 2)
        return np.einsum("nki,nk->ni", velocity, self._creep_s)

    def _slid_slowly(self, before: Before, model: Model) -> Array:
        """Returns the part (n, 2), m, of blocks that slid slowly before their slips."""
        found, down = np.zeros((len(self), 2)), self._resting.down.reshape(-1, CREEP_POINTS, 2)
        way_m = self._creep_s[before.rows] * before.speed_m_s(model)
        found[before.rows] = np.einsum("nk,nki->ni", way_m, down[before.rows])
        return found

    @property
    def hooks(self) -> frozenset[str]:
        """The methods of `Effect` that can change the channel: what holds, too, if blocks slid slowly before slips."""
        return super().hooks if self._slid is None else super().hooks | {*HOLDING}

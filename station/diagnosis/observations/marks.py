"""The image channels: the apparent motion of block and plate before the slide, and the mark's strain."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.observations.channel import REST, Channel, Rows
from station.diagnosis.observations.moments import Latest, Moments
from station.physics.contact import GRAVITY_M_S2, Array, View
from station.physics.effect import Effect
from station.physics.model import Model

CREEP_POINTS = 49
"""Most of a shaking arm's creep falls into the last tenth of the way to the slip."""
COMMON_ROUNDS = 8
TRUE_ROUNDS = 2
"""A lens of a twentieth leaves a thousandth of itself after one round, and a thirtieth of that after another."""
LEAST_PULL = 1e-6
"""Strains that are equal to so much of their noise have no scatter to divide by."""
SENSOR_POINTS = 15


class PlateMarks(Channel):
    """The apparent motion of the plate's own fiducials down the slope, m, at the block mark's height.

    `view` and `start` see the mark in each stretch of the tilt (n) and level before the tilt (n).
    """

    name: str = "plate"
    title: str = "the place of the plate's own marks"
    phase: str = "pre-slip"
    unit: str = "m"
    level_tells: bool = True
    trusted: float = thresholds.PLACE_TRUSTED_M

    def __init__(self, rows: Rows, moved_m: Array, view: View, start: View) -> None:
        super().__init__(rows)
        self._moved, self._view, self._start = moved_m, view, start

    def residual(self, model: Model) -> Array:
        """Recorded minus predicted apparent motion (n,), m."""
        return self._moved - (self._predicted(model) * self._view.down).sum(axis=1)

    def _predicted(self, model: Model) -> Array:
        """The predicted apparent motion (n, 2), m."""
        return (model.seen(self._view) - model.seen(self._start)).mean(axis=1)


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
        """The places (n,), m, which no model changes."""
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
    ) -> None:
        super().__init__(rows, moved_m, view, start)
        resting = creeping.reported
        holds = np.tan(limit_rad) * resting.pressing_m_s2
        pulls = GRAVITY_M_S2 * np.sin(resting.tilt_rad)
        self._resting, self._creep_s = replace(resting, spare_m_s2=holds - pulls), creep_s
        self._crept = Latest(self._crept_under, ("creep",))

    def _predicted(self, model: Model) -> Array:
        moved = super()._predicted(model)
        return moved + self._crept(model) if model.acting("creep") else moved

    def _crept_under(self, model: Model) -> Array:
        """The creep's part of the predicted motion (n, 2), m."""
        velocity = model.creep(self._resting).reshape(len(self), CREEP_POINTS, 2)
        return (velocity * self._creep_s[..., None]).sum(axis=1)


class Shape(Channel):
    """Strain of the mark's image in the block's axes (xx, yy, xy: three rows a view), less the mark's own.

    A mark is never printed exactly: what all views share beside a model's strain is the mark's own. `spread_m` (n, 2)
    is the root mean square way of the mark along its path in the view's frames, over which the strain is a mean.
    """

    name: str = "shape"
    title: str = "the mark's shape"
    phase: str = "camera at rest"
    unit: str = "1"
    trusted: float = thresholds.STRAIN_TRUSTED

    def __init__(self, rows: Rows, strain: Array, view: View, yaw_rad: Array, spread_m: Array) -> None:
        super().__init__(rows)
        self._strain, self._view, self._yaw, self._spread = strain, view, yaw_rad, spread_m[:, None, :]

    def changed_by(self, effect: Effect) -> bool:
        """False for what moves a mark as a whole."""
        return super().changed_by(effect) and effect.strains

    def residual(self, model: Model) -> Array:
        """Recorded minus predicted strain (3 n,)."""
        if not any(self.changed_by(term.effect) for term in model.acting("seen")):
            return self._apart(self._strain)
        moved = strain_of(self._view.point_m, self._view.point_m + self._seen(model), self._yaw)
        return self._apart(self._strain - moved)

    def _apart(self, strain: Array) -> Array:
        """Strains (n, 3) less what they have in common: (3 n,)."""
        return (strain - common(strain, self.rows.sigma[:: strain.shape[1]])).ravel()

    def _seen(self, model: Model) -> Array:
        """The corners' displacement (n, 4, 2), m, at the mark's true place; the view has its apparent one.

        It is the mean of two places on the path, whose mean and spread are those of the view's frames.
        """
        seen, true = self._view.point_m, self._view.point_m
        for _ in range(TRUE_ROUNDS):
            true = seen - model.seen(replace(self._view, point_m=true)).mean(axis=1, keepdims=True)
        ahead, behind = (model.seen(replace(self._view, point_m=true + way)) for way in (self._spread, -self._spread))
        return 0.5 * (ahead + behind)


def common(values: Array, sigma: Array) -> Array:
    """The values (k,) that the rows (n, k) have in common: the maximum likelihood of Student's t with 3 degrees.

    `sigma` (n,) are the rows' standard deviations up to a factor: where the noise grows during a session, the mean of
    all rows is off by more than the best of them are, which then seem to share a strain.

    Its weights change smoothly with the values, so that a fit has slopes. The difference of two medians of skew values,
    as a lens makes them, was off by a per cent of the lens (tests/unit/diagnosis/test_image_rows.py).
    """
    precision, middle = 1.0 / np.square(sigma)[:, None], np.median(values, axis=0)
    for _ in range(COMMON_ROUNDS):
        off = precision * (values - middle) ** 2
        weight = precision / (1.0 + off / np.maximum(3.0 * off.mean(axis=0), LEAST_PULL**2))
        middle = (weight * values).sum(axis=0) / weight.sum(axis=0)
    return middle


def strain_of(model_m: Array, seen_m: Array, yaw_rad: Array) -> Array:
    """Strain (n, 3: xx, yy, xy), in the block's axes, of a mark's corners as seen against those of a rigid mark.

    `seen_m` (n, 4, 2) and `model_m` (n, 4, 2) are in P, m, and the block's heading there is `yaw_rad` (n,), rad.
    """
    rigid = model_m - model_m.mean(axis=1, keepdims=True)
    apparent = seen_m - seen_m.mean(axis=1, keepdims=True)
    cosine, sine = np.cos(yaw_rad), np.sin(yaw_rad)
    turn = np.stack([np.stack([cosine, sine], axis=-1), np.stack([-sine, cosine], axis=-1)], axis=-2)
    rigid, apparent = (np.einsum("nij,nkj->nki", turn, points) for points in (rigid, apparent))
    square = np.einsum("nki,nkj->nij", rigid, rigid)
    gradient = np.einsum("nki,nkj->nij", apparent, rigid) @ np.linalg.inv(square)
    return np.column_stack(
        [gradient[:, 0, 0] - 1, gradient[:, 1, 1] - 1, 0.5 * (gradient[:, 0, 1] + gradient[:, 1, 0])]
    )


class Sensor(Channel):
    """Another angle sensor minus the arm's attitude, rad, less the session's mean (the sensor's mounting).

    Rows are means of readings; `moments` has SENSOR_POINTS of them for each row.
    """

    phase: str = "pre-slip"
    unit: str = "rad"
    trusted: float = thresholds.ANGLE_TRUSTED_RAD

    def __init__(self, rows: Rows, source: str, difference_rad: Array, moments: Moments) -> None:
        super().__init__(rows)
        self.name, self.title = f"sensor:{source}", f"the angle sensor {source}"
        self._difference, self._moments = self._apart(difference_rad), moments

    def residual(self, model: Model) -> Array:
        """Recorded minus predicted difference (n,), rad."""
        if not (model.acting("attitude") or model.acting("delay_s")):
            return self._difference
        turned = self._moments.loads(model).contact.tilt_rad - self._moments.reported.tilt_rad
        change = turned.reshape(len(self), SENSOR_POINTS).mean(axis=1)
        return self._difference - self._apart(change)

    def _apart(self, values: Array) -> Array:
        """Values (n,) less their mean, in which long stretches of readings count more."""
        return values - np.average(values, weights=1.0 / np.square(self.rows.sigma))

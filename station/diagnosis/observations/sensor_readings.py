"""An angle sensor's readings against the attitude that a model makes of the arm's, whichever way the sensor is turned.

Nobody knows how a sensor is turned on the plate. What knows gravity's direction is turned as it agrees best with the
plate that the model says (Kabsch 1976, Acta Crystallographica A 32, 922), and what remains does not depend on the
mounting. A turn about a level axis adds to the tilt by its cosine with the tilt's axis, so tilts in opposite directions
tell an offset of the arm's angle from it; and it turns with the plate, as a level error, which is fixed in the world,
does not: across the slope that is a difference of (1 - cos tilt).

A sensor that knows the tilt alone tells less: it may have an offset as well, and what is across the slope is lost.

A sensor's stamps are late as well, by what its filter, driver and network take. That is a Gaussian variable which all
readings share, and it is integrated out: the part of the residuals that goes as the tilt's rate is divided by what it
then has of standard deviations.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from station.diagnosis.observations.moments import Latest, Moments
from station.physics.contact import Array, Contact
from station.physics.model import Model
from station.signals.tracks import Integers

DEPENDENT = 1e-9
"""Columns that differ by less of their size are the same within rounding: tilts one way alone tell no second turn."""

LATENCY_S = 0.02
"""The prior's standard deviation of a sensor's own lateness, s, as large as a clock's is typically off. Readings that
were 8 ms late were a clock of camera and arm (1.00), which friction hardly tells from none
(`pytest -m benchmark -s tests/benchmarks/test_other_rigs.py` prints what is said of a sensor that is 15 ms late)."""

TURNING = ("attitude", "delay_s")
"""The methods of an effect that change what a sensor reads."""


class Stretches:
    """The moments (m,) at which models are asked for the plate, in stretches (n,) of `count` (n,) moments each."""

    def __init__(self, moments: Moments, count: Integers) -> None:
        self.moments, self._count = moments, count
        self._begins = np.cumsum(count) - count
        self.middles = self._begins + count // 2

    @property
    def rate_rad_s(self) -> Array:
        """The mean rate (n,) of the reported tilt, rad/s."""
        reported = self.moments.reported
        return self.means((reported.rate_rad_s * reported.tilt_axis).sum(axis=1))

    @property
    def middle(self) -> Contact:
        """The contact (n,) as reported in the middle of each stretch."""
        return self.moments.reported.chosen(self.middles)

    def changes(self, model: Model, of: Callable[[Contact], Array]) -> Array | float:
        """Returns by how much a model changes a quantity `of` the contact on average (n,) or (n, 3), in its unit."""
        if not any(model.acting(hook) for hook in TURNING):
            return 0.0
        return self.means(of(self.moments.loads(model).contact) - of(self.moments.reported))

    def means(self, values: Array) -> Array:
        """Returns the means (n,) or (n, 3) of `values` (m,) or (m, 3) in each stretch, in their unit."""
        sums = np.add.reduceat(values, self._begins, axis=0)
        return sums / self._count.reshape(-1, *[1] * (values.ndim - 1))


class Lateness:
    """A shared lateness of readings whose tilt has the rates (n,), rad/s, with the noise `sigma` (n,), rad."""

    def __init__(self, rate_rad_s: Array, sigma: Array) -> None:
        self._sigma, late = sigma, LATENCY_S * rate_rad_s / sigma
        square = float(late @ late)
        self._late = late
        self._share = (1.0 - 1.0 / np.sqrt(1.0 + square)) / max(square, np.finfo(float).tiny)

    def less(self, residual: Array) -> Array:
        """Returns residuals (n,), rad, of covariance σ² again, for a `residual` (n,), rad, that has σ² + s² r rᵀ."""
        return residual - self._sigma * self._late * (self._share * (self._late @ (residual / self._sigma)))


class Directions:
    """Mean readings of gravity's direction (n, 3) in stretches, and what the arm `reported` (n, 3) meanwhile.

    `sigma` (n,), rad, is their noise, and `mount_rad` (n,) the plate's turn in its own mount: in each the sensor is
    turned otherwise.
    """

    def __init__(self, read: Array, reported: Array, *, stretches: Stretches, sigma: Array, mount_rad: Array) -> None:
        self._read, self._reported, self._stretches = read, reported, stretches
        self._weight = 1.0 / np.square(sigma)
        self._mounts = [mount_rad == mount for mount in np.unique(mount_rad)]
        middle = stretches.middle
        sine, cosine = np.sin(middle.tilt_rad), np.cos(middle.tilt_rad)
        self._along = np.column_stack([cosine[:, None] * middle.down, sine])
        self._across = middle.tilt_axis
        self._late = Lateness(stretches.rate_rad_s, sigma)
        self._apart = Latest(self._differs, TURNING)

    def along(self, model: Model) -> Array:
        """Returns how much steeper (n,), rad, the sensor reads than the model says."""
        return self._late.less((self._apart(model) * self._along).sum(axis=1))

    def across(self, model: Model) -> Array:
        """Returns how much farther (n,), rad, the sensor reads about the slope's own direction than the model says."""
        return (self._apart(model) * self._across).sum(axis=1)

    def _differs(self, model: Model) -> Array:
        """Returns the differences (n, 3) of the unit vectors."""
        said = self._reported + self._stretches.changes(model, lambda contact: contact.gravity)
        found = np.empty_like(said)
        for own in self._mounts:
            turn = _turn(self._read[own], said[own], self._weight[own])
            found[own] = self._read[own] @ turn.T - said[own]
        return found


class Tilts:
    """Mean differences (n,), rad, of a sensor's tilts and the arm's in stretches; the others are as of `Directions`."""

    def __init__(self, difference_rad: Array, *, stretches: Stretches, sigma: Array, mount_rad: Array) -> None:
        self._stretches, self._sigma = stretches, sigma
        down = stretches.middle.down
        turned = np.column_stack([down, np.ones(len(down))])
        within = [np.where((mount_rad == mount)[:, None], turned, 0.0) for mount in np.unique(mount_rad)]
        self._mounting = _orthonormal(np.hstack(within) / sigma[:, None])
        self._late = Lateness(self._apart(stretches.rate_rad_s), sigma)
        self._difference = difference_rad

    def along(self, model: Model) -> Array:
        """Returns how much steeper (n,), rad, the sensor reads than the model says, to first order in its turn."""
        change = self._stretches.changes(model, lambda contact: contact.tilt_rad)
        return self._late.less(self._apart(self._difference - change))

    def _apart(self, values: Array) -> Array:
        """Returns values (n,) less their part along the mounting's, in which long stretches of readings count more."""
        along = self._mounting
        return values - self._sigma * (along @ (along.T @ (values / self._sigma)))


def _turn(vectors: Array, onto: Array, weight: Array) -> Array:
    """Returns the rotation (3, 3) that turns vectors (n, 3) nearest to others (n, 3), with weights (n,)."""
    left, _, right = np.linalg.svd((weight[:, None] * onto).T @ vectors)
    return left * np.array([1.0, 1.0, np.linalg.det(left @ right)]) @ right


def _orthonormal(columns: Array) -> Array:
    """Returns an orthonormal basis (n, k) of columns (n, m)."""
    basis, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    return basis[:, sizes > DEPENDENT * sizes[0]]

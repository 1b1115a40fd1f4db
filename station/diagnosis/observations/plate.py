"""The plate's motion at any time: gravity, rates and accelerations in the plate frame."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from shared.vectors import cross
from station.diagnosis.observations.attitude_fit import AttitudeFit, fitted
from station.diagnosis.observations.cubics import Cubics, Indices, spline_slopes
from station.diagnosis.observations.rate_of_readings import agree, of_readings
from station.physics.contact import Array
from station.physics.reversals import rising, turned_at
from station.signals.pivot import pivot_in_plate
from station.signals.tracks import AttitudeTrack, MotionTrack

Times = NDArray[np.int64]

WILD, FEW, LEAST_READINGS = 2.0, 0.998, 100
"""Attitudes are no source of accelerations if the quantile FEW of theirs is WILD times that of the rates': some
readings are wrong then. With fewer readings than LEAST_READINGS the rates alone count."""

APART_S = 0.0025
"""Accelerations by gravity's slopes are their differences from this much before to this much after. An acceleration
that jumps at each reading would jump for all frames at once that fall on readings, and the least delay would seem to
matter."""

COVERED_S = 0.2
"""A moment that is farther from every reading has no attitude."""


@dataclass(frozen=True, eq=False)
class Attitude:
    """The plate at n moments: gravity's unit vector, angular rate and angular acceleration, all in P, (n, 3) each.

    `rising` (n,) is the tilt's sign of change, `gone_rad` (n,) how far it has gone since that changed, `swing_rad`
    (n, 3) how far it had swung before, and `step_s` (n,) the time since the arm's last step. `pivot_m_s2` (n, 3)
    is the acceleration of the tilts' fixed point in P; 0 where it is not known to move.
    """

    gravity: Array
    rate_rad_s: Array
    acceleration_rad_s2: Array
    rising: Array
    gone_rad: Array
    swing_rad: Array
    step_s: Array
    pivot_m_s2: Array | float = 0.0

    @property
    def tilt_rad(self) -> Array:
        """Angle between the plate's normal and up (n,)."""
        return np.arctan2(np.hypot(self.gravity[:, 0], self.gravity[:, 1]), -self.gravity[:, 2])

    @property
    def down_rad(self) -> Array:
        """Direction of the steepest descent in P (n,)."""
        return np.arctan2(self.gravity[:, 1], self.gravity[:, 0])

    def quickened(self, by_rad_s2: Array | float) -> Attitude:
        """Returns the same moments with so much more angular acceleration (n, 3), rad/s²."""
        return replace(self, acceleration_rad_s2=self.acceleration_rad_s2 + by_rad_s2)

    def again(self, rows: Times, *, turn_rad: Array, faster: Array, since: Array) -> Attitude:
        """Returns some moments of runs redone, tilted further round and faster.

        The tilt up to which the plate has turned is passed at the other rate, so what is beyond it changes by that
        factor.

        Args:
            rows: (m,) the indices of the moments.
            turn_rad: (m,) how much further round the plate is tilted, rad.
            faster: (m,) the factor on the rate of the tilt.
            since: (m,) the tilt up to which the plate has turned, rad.
        """
        way = np.column_stack([np.cos(turn_rad), np.sin(turn_rad)])
        tilt, down = (since + faster * (self.tilt_rad[rows] - since), self.down_rad[rows] + turn_rad)
        level = np.sin(tilt)
        pivot = self.pivot_m_s2
        return Attitude(
            gravity=np.column_stack([level * np.cos(down), level * np.sin(down), -np.cos(tilt)]),
            rate_rad_s=turned(self.rate_rad_s[rows] * faster[:, None], way),
            acceleration_rad_s2=turned(self.acceleration_rad_s2[rows], way),
            rising=self.rising[rows],
            gone_rad=self.gone_rad[rows] * faster,
            swing_rad=self.swing_rad[rows] * faster[:, None],
            step_s=self.step_s[rows] / faster,
            pivot_m_s2=turned(pivot[rows], way) if isinstance(pivot, np.ndarray) else pivot,
        )


def turned(vectors: Array, way: Array) -> Array:
    """Returns vectors (n, 2 or 3) turned about the plate's normal by the angles whose unit vectors are `way` (n, 2)."""
    x, y, (cosine, sine) = vectors[:, 0], vectors[:, 1], way.T
    return np.column_stack([cosine * x - sine * y, sine * x + cosine * y, vectors[:, 2:]])


class PlateMotion:
    """Interpolates the recorded attitude: gravity by cubics through its values and rates, the rates by a spline.

    Values and rates are those that `fitted` (attitude_fit) makes of the recorded ones, or `of_readings` of the values
    alone; `fit` is None if there are too few.

    The accelerations are differences of the former's slopes, or else the slopes of the latter.

    Chords of gravity would be off by a tenth of a millidegree while the plate is set in motion, always to the same
    side, so that a thousand slides would show it.
    """

    def __init__(self, attitude: AttitudeTrack, motions: MotionTrack) -> None:
        known = attitude.known()
        self._origin = int(known.time_ns[0]) if len(known) else 0
        self._time_s: Array = np.asarray((known.time_ns - self._origin) * 1e-9, dtype=np.float64)
        rate, read = np.nan_to_num(known.rate_rad_s), known.gravity
        gravity = read
        self.fit = _fit(self._time_s, read, rate) if len(known) > 2 else None
        if self.fit is not None:
            rate, gravity = self.fit.rate_rad_s, self.fit.gravity
            read = gravity if self.fit.by_readings else read
        slopes = spline_slopes(self._time_s, rate)
        self._rates = Cubics(self._time_s, rate, slopes.__getitem__)
        self._gravity = Cubics(self._time_s, gravity, partial(_turning, gravity, rate)) if len(known) > 1 else None
        self._swing = self._swinging(Cubics(self._time_s, read, partial(_turning, read, rate)), slopes)
        tilt = np.arccos(np.clip(-gravity[:, 2], -1.0, 1.0)) if len(known) else np.zeros(0)
        self._rising = rising(self._time_s, tilt, self._time_s) if len(known) > 2 else np.ones(len(known))
        # The arm comes down to a level plate.
        self._turned_rad, self._swing_rad = turned_at(tilt, self._rising, before_rad=0.0)
        self._steps_ns = np.sort(motions.time_ns)
        pivot = pivot_in_plate(known, self._time_s)
        # By columns: interpolation would copy each strided one, a whole session, at every call.
        self._pivot = None if pivot is None else np.ascontiguousarray(pivot.T)

    def __len__(self) -> int:
        return len(self._time_s)

    def covers(self, time_ns: int) -> bool:
        """Returns true if an attitude was recorded within COVERED_S of a moment."""
        if not len(self):
            return False
        second = (time_ns - self._origin) * 1e-9
        index = int(np.searchsorted(self._time_s, second))
        return bool(np.min(np.abs(self._time_s[max(index - 1, 0) : index + 1] - second)) < COVERED_S)

    def for_stamps(self, *, late_s: float) -> PlateMotion:
        """Gives the same motion, which stamps that are late by `late_s` ask for what was then."""
        found, late_ns = copy.copy(self), round(late_s * 1e9)
        found._origin, found._steps_ns = self._origin + late_ns, self._steps_ns + late_ns
        return found

    def at(self, time_ns: Times, *, delay_s: float = 0.0) -> Attitude:
        """Returns the plate, `delay_s` before the moments `time_ns` (n,), ns."""
        seconds = self._seconds(time_ns) - delay_s
        gravity = self._gravity_at(seconds)
        last = self._last(seconds)
        inside = np.clip(seconds, self._time_s[0], self._time_s[-1])
        acceleration = self._rates.slope(inside)
        if self._swing is not None:
            seen = _seen(self._apart(self._swing, seconds), gravity)
            acceleration = seen + gravity * (acceleration * gravity).sum(axis=1, keepdims=True)
        since_s = self._since_step(time_ns, delay_s)
        pivot = 0.0 if self._pivot is None else _interpolated(seconds, self._time_s, self._pivot)
        tilt = np.arctan2(np.hypot(gravity[:, 0], gravity[:, 1]), -gravity[:, 2])
        return Attitude(
            gravity=gravity,
            rate_rad_s=self._rates(inside),
            acceleration_rad_s2=acceleration,
            rising=self._rising[last],
            gone_rad=np.abs(tilt - self._turned_rad[last]),
            swing_rad=self._swing_rad[last],
            step_s=since_s,
            pivot_m_s2=pivot,
        )

    def sigma_rad(self, time_ns: Times) -> Array:
        """Returns the standard deviation (n,) of gravity's direction at `time_ns` (n,), ns, in rad, by the noise."""
        if self.fit is None:
            return np.zeros(len(time_ns))
        return np.interp(self._seconds(time_ns), self._time_s, self.fit.sigma_rad)

    def mean_sigma_rad(self, weight: Array, length_s: float) -> float:
        """Returns the standard deviation (rad) of gravity's mean over `length_s` with the weights `weight` (k,).

        They are even in time, and sum to 1.
        """
        if self.fit is None:
            return 0.0
        count = max(1, round(length_s / float(np.median(np.diff(self._time_s)))))
        # Each reading stands for the time around it: the ends, where weights may be 0, are none of two readings.
        middles = (np.arange(count) + 0.5) / count
        even = np.interp(middles, np.linspace(0.0, 1.0, len(weight)), weight)
        return self.fit.of_mean(even / even.sum())

    def steps_between(self, from_ns: int, to_ns: int) -> Times:
        """Returns the times (n,), ns, at which the arm was sent off, from `from_ns` until `to_ns`."""
        first, last = np.searchsorted(self._steps_ns, (from_ns, to_ns))
        return self._steps_ns[first:last]

    def gravity_at(self, time_ns: Times) -> Array:
        """Returns unit vectors (n, 3) of gravity in P at `time_ns` (n,), ns."""
        return self._gravity_at(self._seconds(time_ns))

    def turns_at(self, time_ns: Times) -> tuple[Array, Array, Array]:
        """Returns the tilt's sign of change (n,) at times, the tilt (n,) where that changed, and swings before (n, 3).

        `time_ns` (n,) are in ns, the rest in rad.
        """
        last = self._last(self._seconds(time_ns))
        return self._rising[last], self._turned_rad[last], self._swing_rad[last]

    def _last(self, seconds: Array) -> Times:
        """Returns the last reading (n,) before each time (n,), s, by its index."""
        return np.clip(np.searchsorted(self._time_s, seconds, side="right") - 1, 0, len(self) - 1)

    def _apart(self, moving: Callable[[Array], Array], seconds: Array) -> Array:
        """Returns the slope (n, 3) of a quantity between APART_S before and APART_S after each time (n,), s."""
        after = np.clip(seconds + APART_S, self._time_s[0], self._time_s[-1])
        before = np.clip(seconds - APART_S, self._time_s[0], self._time_s[-1])
        return (moving(after) - moving(before)) / (2.0 * APART_S)

    def _swinging(self, recorded: Cubics, slopes: Array) -> Callable[[Array], Array] | None:
        """Returns the derivative of recorded gravity, if it errs by less than the rates' `slopes` (n, 3); else None.

        A plate that stops midway between two readings has two accelerations, of which rates alone show the mean. That
        is half a per cent of a block's friction just when it slips. The two ways differ by the errors of both: by the
        attitudes' noise at every reading, so that half of the differences are below its median, and by what the rates
        do not show at few. Of two normal components sqrt(2 ln 2) sd is the median of their length, and 2 sd^2 its mean
        square.
        """
        along = recorded.values[:-1]
        if len(along) < LEAST_READINGS:
            return None
        shown = _seen(recorded.bends(), along)
        splined = slopes[:-1] - along * (slopes[:-1] * along).sum(axis=1, keepdims=True)
        apart = np.linalg.norm(shown - splined, axis=1)
        by_attitudes = float(np.median(apart)) ** 2 / np.log(2.0)
        by_rates = float(np.square(apart).mean()) - by_attitudes
        most, usual = (float(np.quantile(np.linalg.norm(each, axis=1), FEW)) for each in (shown, splined))
        return recorded.slope if by_attitudes < by_rates and most <= WILD * usual else None

    def _seconds(self, time_ns: Times) -> Array:
        return np.asarray((time_ns - self._origin) * 1e-9, dtype=np.float64)

    def _gravity_at(self, seconds: Array) -> Array:
        if self._gravity is None:
            raise ValueError("expected at least two readings of the attitude")
        gravity = self._gravity(np.clip(seconds, self._time_s[0], self._time_s[-1]))
        return gravity / np.linalg.norm(gravity, axis=1, keepdims=True)

    def _since_step(self, time_ns: Times, delay_s: float) -> Array:
        if not len(self._steps_ns):
            return np.full(len(time_ns), 1e3)
        now = np.asarray(time_ns) - round(delay_s * 1e9)
        index = np.searchsorted(self._steps_ns, now, side="right") - 1
        return np.where(index >= 0, (now - self._steps_ns[np.maximum(index, 0)]) * 1e-9, 1e3)


def _fit(time_s: Array, gravity: Array, rate_rad_s: Array) -> AttitudeFit:
    """Returns what the recorded gravity and rates (n, 3) say together, or gravity alone where the rates say nothing."""
    if agree(rate_rad_s, gravity, time_s):
        return fitted(time_s, gravity, rate_rad_s)
    return of_readings(time_s, gravity)


def _turning(gravity: Array, rates: Array, indices: Indices) -> Array:
    """Returns the change (m, 3), 1/s, of gravity (n, 3) by the rates (n, 3) at some of the readings."""
    return -cross(rates[indices], gravity[indices])


def _interpolated(seconds: Array, time_s: Array, columns: Array) -> Array:
    """Returns columns (3, n) at other times (m,), as (m, 3)."""
    return np.column_stack([np.interp(seconds, time_s, column) for column in columns])


def _seen(bend: Array, gravity: Array) -> Array:
    """Returns the angular acceleration (n, 3) that gravity's second derivative shows: g' = -w x g, so w = g' x g."""
    return cross(bend, gravity)

"""The tilt angle over time in one motion: stretches of constant jerk, as fast as rate, acceleration and jerk allow.

A motion to rest at an angle changes the rate twice: to a peak rate, and from there to zero; the acceleration is zero
at the peak, where the rate turns. Each change is the fastest that acceleration and jerk allow, so that the peak rate
alone is left to find: the largest that ends at the angle. Where even the highest permitted rate falls short, it is kept
for a while. (R. Haschke, E. Weitnauer, H. Ritter, "On-line planning of time-optimal, jerk-limited trajectories", 2008.)
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
_HALVINGS = 60
"""Halvings of the interval of the peak rate: what is left of it is below a double's own rounding."""


@dataclass(frozen=True, kw_only=True)
class TiltState:
    """The tilt angle and its derivatives at one moment."""

    angle_rad: float = 0.0
    rate_rad_s: float = 0.0
    acceleration_rad_s2: float = 0.0


class Bounds(NamedTuple):
    """The largest rate, acceleration and jerk of a motion, in rad/s, rad/s² and rad/s³."""

    rate: float
    acceleration: float
    jerk: float


class _Moment(NamedTuple):
    """The fields of `TiltState` as plain numbers: finding the peak rate takes hundreds of them."""

    angle: float
    rate: float
    acceleration: float


class _Stretch(NamedTuple):
    """A time, in s, with a constant jerk, in rad/s³; at a steady rate, in rad/s, there is no acceleration."""

    duration_s: float
    jerk: float
    steady_rate: float | None = None


@dataclass(frozen=True, kw_only=True)
class Profile:
    """Stretches (k,) that begin at `starts_s`, the first one at 0, with angle, rate, acceleration and jerk then."""

    duration_s: float
    starts_s: tuple[float, ...]
    angles_rad: tuple[float, ...]
    rates_rad_s: tuple[float, ...]
    accelerations_rad_s2: tuple[float, ...]
    jerks_rad_s3: tuple[float, ...]

    @cached_property
    def _stretches(self) -> Array:
        """Start, angle, rate, acceleration and jerk of each stretch, (5, k)."""
        states = (self.angles_rad, self.rates_rad_s, self.accelerations_rad_s2, self.jerks_rad_s3)
        return np.array([self.starts_s, *states])

    def at(self, seconds: ArrayLike) -> tuple[Array, Array, Array]:
        """Returns angle, rate and acceleration, each (…,), by rad and s, at times (…,), s, clipped to the motion."""
        time = np.minimum(np.maximum(seconds, 0.0), self.duration_s)
        stretches = self._stretches
        start, angle, rate, acceleration, jerk = stretches[:, stretches[0].searchsorted(time, side="right") - 1]
        u = time - start
        return (
            angle + u * (rate + u * (acceleration / 2 + u * jerk / 6)),
            rate + u * (acceleration + u * jerk / 2),
            acceleration + u * jerk,
        )


def profile_to_rest(start: TiltState, *, bounds: Bounds) -> Profile:
    """Returns the fastest way to rest, wherever that is."""
    now = _moment(start)
    return _profile(now, _change(now, 0.0, bounds))


def profile_to_angle(start: TiltState, *, angle_rad: float, bounds: Bounds) -> Profile:
    """Returns the way to rest at an angle. A start beyond the bounds is brought within them first.

    It is the fastest way, but for a start that already brakes, towards a little behind where it would come to rest.
    """
    now = _moment(start)
    ahead = math.copysign(1.0, angle_rad - _end(now, _change(now, 0.0, bounds)).angle)
    """The direction of the angle, seen from where the arm would come to rest."""

    def missing(peak: float) -> float:
        """Returns how far a motion with that peak rate (0 or more) ends before the angle."""
        return ahead * (angle_rad - _end(now, _by_peak(now, ahead * peak, 0.0, bounds)).angle)

    if (left := missing(bounds.rate)) >= 0.0:
        return _profile(now, _by_peak(now, ahead * bounds.rate, left / bounds.rate, bounds))
    coasting = min(max(ahead * _coasting_rate(now, bounds), 0.0), bounds.rate)
    low, high = (coasting, bounds.rate) if missing(coasting) >= 0.0 else (0.0, coasting)
    return _profile(now, _by_peak(now, ahead * _last_short(missing, low, high), 0.0, bounds))


def _last_short(missing: Callable[[float], float], low: float, high: float) -> float:
    """Returns the peak rate between `low`, which ends before the angle, and `high`, which ends behind it."""
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if missing(middle) >= 0.0 else (low, middle)
    return low


def _by_peak(now: _Moment, peak: float, kept_s: float, bounds: Bounds) -> list[_Stretch]:
    """Returns the stretches to a peak rate, which is kept for a time, and from there to rest."""
    return [*_change(now, peak, bounds), _Stretch(kept_s, 0.0, peak), *_change(_Moment(0.0, peak, 0.0), 0.0, bounds)]


def _change(now: _Moment, rate: float, bounds: Bounds) -> list[_Stretch]:
    """Returns the fastest way from a state to a rate with no acceleration.

    The acceleration rises, is kept at its bound, and falls.
    """
    jerk, way = bounds.jerk, math.copysign(1.0, rate - _coasting_rate(now, bounds))
    begun, gain = way * now.acceleration, way * (rate - now.rate)
    free = math.sqrt(max(jerk * gain + begun * begun / 2, 0.0))
    """The largest acceleration on the way without its bound."""
    peak = min(free, bounds.acceleration)
    rise = peak - begun
    """It is negative for a start beyond the bounds, whose acceleration is lowered first."""
    kept_s = (gain - (abs(rise) * (peak + begun) + peak * peak) / (2 * jerk)) / peak if free > peak else 0.0
    return [
        _Stretch(abs(rise) / jerk, math.copysign(jerk, way * rise)),
        _Stretch(max(kept_s, 0.0), 0.0),
        _Stretch(peak / jerk, -way * jerk),
    ]


def _coasting_rate(now: _Moment, bounds: Bounds) -> float:
    """Returns the rate at which a state arrives whose acceleration is brought to zero at once."""
    return now.rate + now.acceleration * abs(now.acceleration) / (2 * bounds.jerk)


def _moment(state: TiltState) -> _Moment:
    return _Moment(state.angle_rad, state.rate_rad_s, state.acceleration_rad_s2)


def _at_start(now: _Moment, stretch: _Stretch) -> _Moment:
    """Gives the state without the rounding error of the acceleration, which would grow with the square of the time."""
    return now if stretch.steady_rate is None else _Moment(now.angle, stretch.steady_rate, 0.0)


def _after(now: _Moment, stretch: _Stretch) -> _Moment:
    (angle, rate, acceleration), (t, jerk, _) = _at_start(now, stretch), stretch
    return _Moment(
        angle + t * (rate + t * (acceleration / 2 + t * jerk / 6)),
        rate + t * (acceleration + t * jerk / 2),
        acceleration + t * jerk,
    )


def _end(now: _Moment, stretches: list[_Stretch]) -> _Moment:
    for stretch in stretches:
        now = _after(now, stretch)
    return now


def _profile(now: _Moment, stretches: list[_Stretch]) -> Profile:
    rows: list[tuple[float, ...]] = []
    begin_s = 0.0
    for stretch in stretches:
        if stretch.duration_s > 0.0 or not rows:
            rows.append((begin_s, *_at_start(now, stretch), stretch.jerk))
        now, begin_s = _after(now, stretch), begin_s + stretch.duration_s
    starts, angles, rates, accelerations, jerks = zip(*rows, strict=True)
    return Profile(
        duration_s=begin_s,
        starts_s=starts,
        angles_rad=angles,
        rates_rad_s=rates,
        accelerations_rad_s2=accelerations,
        jerks_rad_s3=jerks,
    )

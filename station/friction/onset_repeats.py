"""Readings of the tilt that repeat the one before while the plate turns: they are none, and leave the way uncertain.

Encoders that are stuck for a moment, and coarse ones, send one reading again and again. That is no rest if the plate
then jumps: one that begins to turn is slower at first than afterwards. The tilt of such a stretch is read off the curve
through all other readings, and its error becomes a part of the fit's covariance model.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from station.friction.onset_loads import GRAVITY_M_S2, Array, hermite

_JUMP = math.sqrt(2.0)
"""A plate that lay still comes to its next reading at its next speed at most; one that did not, at as many times that
as equal readings came, which are two at least (`pytest tests/unit/friction/test_onset_repeats.py`)."""
_ANYWHERE = 1.0 / math.sqrt(12.0)
"""The standard deviation of a tilt that may be anywhere between two readings, as a share of their difference."""


@dataclass(frozen=True, slots=True)
class Stretches:
    """Stretches (k,) of repeated readings: when they begin and end, s, and how far the plate turned meanwhile, rad."""

    begin_s: Array
    end_s: Array
    turn_rad: Array

    def ways_m(self, time_s: Array) -> Array:
        """Returns ways (n, 2 k), m, at `time_s` (n,): by one standard deviation of the tilt in each half of a stretch.

        A block on a plate that is so much steeper for that time is faster ever after.
        """
        middle_s = 0.5 * (self.begin_s + self.end_s)
        begin_s, end_s = np.append(self.begin_s, middle_s), np.append(middle_s, self.end_s)
        steeper = GRAVITY_M_S2 * _ANYWHERE * np.tile(self.turn_rad, 2)
        since = np.maximum(time_s[:, None] - begin_s, 0.0) ** 2 - np.maximum(time_s[:, None] - end_s, 0.0) ** 2
        return 0.5 * steeper * since


def without_repeats(time_s: Array, tilt_rad: Array) -> tuple[Array, Stretches]:
    """Returns the tilt (n,), rad, read again where it only repeats, and the stretches in which its error is unknown.

    Readings that repeat to the very end stay as they are: the plate lies still, or goes on as before.

    Args:
        time_s: rising times (n,) of the readings.
        tilt_rad: their tilts (n,).
    """
    first = np.flatnonzero(np.diff(tilt_rad, prepend=np.nan))
    last = np.append(first[1:], len(tilt_rad)) - 1
    repeats, begin_s, end_s = last > first, time_s[first], np.append(time_s[first[1:]], time_s[-1])
    turn_rad = np.abs(np.diff(tilt_rad[first]))
    speed = turn_rad / np.diff(begin_s)
    turn_rad = np.append(turn_rad, speed[-1:].sum() * (end_s[-1] - begin_s[-1]))
    stale = repeats & _jumps(turn_rad[:-1] / (end_s - time_s[last])[:-1], speed, stops=bool(repeats[-1]))
    fresh = ~np.repeat(stale, last - first + 1)
    fresh[first] = True
    stale[-1] = repeats[-1]
    return _read_again(time_s, tilt_rad, fresh=fresh), Stretches(begin_s[stale], end_s[stale], turn_rad[stale])


def _jumps(first_speed: Array, speed: Array, *, stops: bool) -> NDArray[np.bool_]:
    """Returns true (k,) for readings after which the plate comes to the next at more than its speed (k - 1,) then.

    Nothing is known of what follows the last ones, but that the plate `stops` there.
    """
    next_speed = np.append(speed[1:], 0.0 if stops else np.inf)[: len(speed)]
    return np.append(first_speed > _JUMP * next_speed, False)


def _read_again(time_s: Array, tilt_rad: Array, *, fresh: NDArray[np.bool_]) -> Array:
    """Returns the tilt (n,), read off the curve through its fresh readings where others are not."""
    if fresh.all():
        return tilt_rad
    known_s, known = time_s[fresh], tilt_rad[fresh]
    return np.where(fresh, tilt_rad, hermite(known_s, known, np.gradient(known, known_s), at=time_s))

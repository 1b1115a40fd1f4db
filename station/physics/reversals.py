"""Turning points of a plate's tilt, from readings of it, as play and other effects of the direction need them."""

from __future__ import annotations

import numpy as np

from station.physics.contact import Array

NEAR_S, STILL_RAD = 0.05, 5e-4
"""A plate that turns by less than STILL_RAD within twice NEAR_S is at rest.

An arm that overshoots by a hundredth of a millidegree, or whose report is rounded, has not turned back.
"""


def rising(time_s: Array, tilt_rad: Array, at_s: Array) -> Array:
    """The tilt's sign of change (m,) at times `at_s` (m,), s: +1 at first, its last sign at rest.

    It is told from the readings `tilt_rad` (n,), rad, at the times `time_s` (n,), s, ascending.
    """
    change = np.interp(at_s + NEAR_S, time_s, tilt_rad) - np.interp(at_s - NEAR_S, time_s, tilt_rad)
    return last_sign(change, STILL_RAD)


def last_sign(change: Array, still_rad: float) -> Array:
    """The sign (n,) of each change (n,), or of the last one before it beyond `still_rad`; +1 before there was any."""
    sign = np.where(np.abs(change) > still_rad, np.sign(change), 0.0)
    moved = np.maximum.accumulate(np.where(sign != 0, np.arange(len(sign)), -1))
    return np.where(moved >= 0, sign[np.maximum(moved, 0)], 1.0)


def turned_at(tilt_rad: Array, sign: Array, *, before_rad: float) -> Array:
    """The tilt (n,), rad, at which it last turned round: the farthest that it had come the other way.

    `tilt_rad` (n,), rad, goes on in the directions `sign` (n,), +1 or −1. Before they change for the first time it is
    `before_rad`.
    """
    ends = [*(np.flatnonzero(np.diff(sign)) + 1).tolist(), len(tilt_rad)]
    turned = np.full(len(tilt_rad), before_rad)
    for before, first, last in zip([0, *ends], ends, ends[1:], strict=False):
        other = tilt_rad[before : first + 1]
        turned[first:last] = other.max() if sign[before] > 0 else other.min()
    return turned

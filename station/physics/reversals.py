"""Turning points of a plate's tilt, from readings of it, as play and other effects of the direction need them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from station.physics.contact import Array

NEAR_S, STILL_RAD = 0.05, 5e-4
"""A plate that turns by less than STILL_RAD within twice NEAR_S is at rest.

An arm that overshoots by a hundredth of a millidegree, or whose report is rounded, has not turned back.
"""


SWINGS = 3
"""The number of swings that are remembered: an arm that overshoots, or whose report is noisy, turns some times."""

LEAST_TURNS = 2
"""The begin and a first turn: what went on before the begin is not known, and it cannot be gone through again."""


def rising(time_s: Array, tilt_rad: Array, at_s: Array) -> Array:
    """Returns the tilt's sign of change (m,): +1 at first, its last sign at rest.

    Args:
        time_s: (n,) the times of the readings, s, ascending.
        tilt_rad: (n,) the readings of the tilt, rad.
        at_s: (m,) the times asked for, s.
    """
    change = np.interp(at_s + NEAR_S, time_s, tilt_rad) - np.interp(at_s - NEAR_S, time_s, tilt_rad)
    return last_sign(change, STILL_RAD)


def last_sign(change: Array, still_rad: float) -> Array:
    """Returns the sign (n,) of each change (n,), or of the last one before it beyond `still_rad`.

    It is +1 before there was any.
    """
    sign = np.where(np.abs(change) > still_rad, np.sign(change), 0.0)
    moved = np.maximum.accumulate(np.where(sign != 0, np.arange(len(sign)), -1))
    return np.where(moved >= 0, sign[np.maximum(moved, 0)], 1.0)


def turned_at(tilt_rad: Array, sign: Array, *, before_rad: float) -> tuple[Array, Array]:
    """Gives the tilt (n,), rad, at which it last turned round, and the swings before (n, SWINGS), rad, the last first.

    A turn lies at the farthest that the tilt had come the other way. A swing back that is gone through again leaves no
    trace, as in a play operator and in rainflow counting (Krasnosel'skii & Pokrovskii 1989): both of its turns are
    forgotten. Before the directions change for the first time the tilt of the turn is `before_rad`; a swing that is not
    known is infinite.

    Args:
        tilt_rad: (n,) the tilt, rad.
        sign: (n,) the directions in which it goes on, +1 or −1.
        before_rad: the tilt of the turn before the first change, rad.
    """
    ends = [*(np.flatnonzero(np.diff(sign)) + 1).tolist(), len(tilt_rad)]
    turned, swing = np.full(len(tilt_rad), before_rad), np.full((len(tilt_rad), SWINGS), np.inf)
    turns = [before_rad]
    for before, first, last in zip([0, *ends], ends, ends[1:], strict=False):
        other = tilt_rad[before : first + 1]
        turns.append(float(other.max() if sign[before] > 0 else other.min()))
        for now, end in _gone_through(turns, sign[first] * tilt_rad[first:last], float(sign[first])):
            turned[first + now : first + end] = turns[-1]
            swing[first + now : first + end] = swings(turns)
    return turned, swing


def swings(turns_rad: Sequence[float]) -> Array:
    """Gives the last swings (SWINGS,), rad, the last first, between turns at these tilts; infinite before the first."""
    known = np.abs(np.diff(turns_rad[-SWINGS - 1 :]))[::-1]
    return np.concatenate([known, np.full(SWINGS - len(known), np.inf)])


def _gone_through(turns: list[float], ahead_rad: Array, sign: float) -> Iterator[tuple[int, int]]:
    """Yields the parts of a way, as begin and end, with the same last turn; those that are gone through leave `turns`.

    `ahead_rad` (n,), rad, is the tilt times its direction, `sign`.
    """
    reached, now = np.maximum.accumulate(ahead_rad), 0
    while now < len(reached):
        known = len(turns) > LEAST_TURNS
        end = int(np.searchsorted(reached, sign * turns[-2], side="right")) if known else len(reached)
        end = max(end, now)
        yield now, end
        if end < len(reached):
            del turns[-2:]
        now = end

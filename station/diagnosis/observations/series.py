"""A continuous record of one sliding contact: averaged in windows of equal slip, with the slip since its speed changed.

The rows of such a record, which has a column displacement_m, are neighbours and no independent runs: what friction does
beside a law goes on from one to the next over some slip, and is estimated as its wander (`likelihood/grouped.py`).

After a change of the speed friction settles over some slip (Dieterich 1979, JGR 84, 2161). A law of the speed says
where it settles: the windows until then are no evidence of that, and are judged apart.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.observations.plate import Times
from station.diagnosis.observations.table_rows import TableRows
from station.physics.contact import Array, Bools

WINDOWS = 200
"""The windows of a record: its slip is resolved to half a per cent, and a covariance of them all is quick to factorise.
"""

SETTLED = "settled"
"""The covariate of the slip since the speed changed."""

NEAR = 2.0
"""Friction has settled where it differs by less than so many standard deviations of its course afterwards."""

CHANGED = 0.5
"""Speeds differ if their logarithms do by so much: protocols step them threefold or more, and a window reads its own to
a fifth."""


def in_windows(rows: TableRows) -> TableRows:
    """Returns the rows of each record averaged in windows, as one group each, and with the windows' numbers from 1 on.

    Rows without a displacement are unchanged.
    """
    known = np.isfinite(rows.displacement_m) & rows.pulled
    if not len(rows) or not known.all() or not np.ptp(rows.time_ns):
        return rows
    group = np.zeros(len(rows), dtype=np.int64) if rows.group is None else rows.group
    parts = [_record(rows.chosen(np.flatnonzero(group == one))) for one in np.unique(group)]
    whole = _joined([part for part, _ in parts])
    number = np.arange(len(whole), dtype=np.float64)
    settled = np.concatenate([settled for _, settled in parts])
    of = np.repeat(np.arange(len(parts)), [len(part) for part, _ in parts])
    named = {"row": np.arange(1, len(whole) + 1), "number": number}
    return replace(whole, **named, group=of, settled=settled, read=rows.read, lost=rows.lost, copies=rows.copies)


def travelled_of(rows: TableRows) -> Array | None:
    """Returns the slip (n,), m, of continuous records; None for single measurements."""
    return rows.displacement_m if len(rows) and np.isfinite(rows.displacement_m).all() and rows.ordered else None


def stretches_of(rows: TableRows) -> Times | None:
    """Returns the number (n,) of each window's stretch of one speed in records; None where there are too few of them.

    Where a speed is set, friction may jump by more than it wanders between, for reasons of the apparatus: each change
    is one piece of evidence for a law of the speed, however many windows follow it. How they scatter is known from some
    of them.
    """
    if travelled_of(rows) is None:
        return None
    ends = _stretches(rows.speed_m_s, rows.group)
    if len(ends) < thresholds.LEAST_KNOWN:
        return None
    return np.repeat(np.arange(len(ends)), [end - begin for begin, end in ends])


def _record(rows: TableRows) -> tuple[TableRows, Array]:
    """Returns the windows of one record, and the slip since its speed changed (n,), log10 m."""
    slip = rows.displacement_m - rows.displacement_m[0]
    slip = np.maximum.accumulate(slip * np.sign(slip[-1]))
    edges = np.linspace(0.0, slip[-1], min(WINDOWS, len(rows)) + 1)
    window = np.clip(np.searchsorted(edges, slip, side="right") - 1, 0, len(edges) - 2)
    begins = np.diff(window, prepend=-1) > 0
    spans = np.split(np.arange(len(rows)), np.flatnonzero(begins)[1:])
    means = {
        name: np.array([getattr(rows, name)[span].mean() for span in spans])
        for name in ("coefficient", "load_n", "speed_m_s")
    }
    means["sigma"] = np.array([_error(rows.coefficient[span]) for span in spans])
    means["displacement_m"] = np.array([slip[span].mean() for span in spans])
    if not rows.speed_m_s.all():
        means["speed_m_s"] = _driven(_speeds(rows.time_ns, slip, begins))
    mean = replace(rows.chosen(np.flatnonzero(begins)), **means)
    return mean, _settled(mean.speed_m_s, mean.displacement_m)


def _error(values: Array) -> float:
    """Returns the relative standard error of a window's mean; nan for a single row."""
    return float(values.std(ddof=1) / np.sqrt(len(values)) / values.mean()) if len(values) > 1 else np.nan


def _speeds(time_ns: Times, slip_m: Array, begins: Bools) -> Array:
    """Returns each window's speed (n,), m/s: its slip over its time, which end where the next window begins."""
    first = np.flatnonzero(begins)
    last = np.append(first[1:], len(time_ns) - 1)
    return np.maximum(slip_m[last] - slip_m[first], 0.0) / np.maximum(1e-9 * (time_ns[last] - time_ns[first]), 1e-9)


def _driven(speed_m_s: Array) -> Array:
    """Returns each stretch's median speed (n,): the drive's, without the noise of a window's own."""
    found = speed_m_s.copy()
    for begin, end in _stretches(speed_m_s):
        found[begin:end] = np.median(speed_m_s[begin:end])
    return found


def _settled(speed_m_s: Array, slip_m: Array) -> Array:
    """Returns the log10 of the slip since a window with another speed (n,); nan before the first change."""
    found = np.full(len(speed_m_s), np.nan)
    for begin, end in _stretches(speed_m_s)[1:]:
        found[begin:end] = np.log10(slip_m[begin:end] - slip_m[begin - 1])
    return found


def settling(rows: TableRows) -> Bools:
    """Returns true (n,) for the windows of records in which friction still settles after a change of the speed.

    It has settled when it first comes as near to the median of the stretch's second half as that half itself stays.
    """
    found = np.zeros(len(rows), dtype=np.bool_)
    for begin, end in _stretches(rows.speed_m_s, rows.group):
        if np.isfinite(rows.settled[begin]):
            found[begin : begin + _unsettled(rows.coefficient[begin:end])] = True
    return found


def _unsettled(coefficient: Array) -> int:
    """Returns the number of windows of a stretch before friction has settled."""
    rest = coefficient[len(coefficient) // 2 :]
    middle = float(np.median(rest))
    near = np.abs(coefficient - middle) <= NEAR * max(float(np.std(rest)), 1e-9)
    return int(np.argmax(near)) if near.any() else len(coefficient)


def _stretches(speed_m_s: Array, group: Times | None = None) -> list[tuple[int, int]]:
    """Returns the first and last (exclusive) window of each stretch of one speed, in records that `group` numbers."""
    logs = np.log(np.maximum(speed_m_s, 1e-300))
    changed = np.abs(np.diff(logs)) > CHANGED
    if group is not None:
        changed |= np.diff(group) != 0
    edges = [0, *(np.flatnonzero(changed) + 1).tolist(), len(speed_m_s)]
    return [(begin, end) for begin, end in itertools.pairwise(edges) if end > begin]


def _joined(parts: Sequence[TableRows]) -> TableRows:
    """Records one after another, as one group."""
    each = [replace(part, group=None).columns() for part in parts]
    return replace(parts[0], group=None, **{name: np.concatenate([one[name] for one in each]) for name in each[0]})

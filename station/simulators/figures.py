"""Figures that sum up errors, each with its standard error: plain and robust ones, side by side."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from station.physics.contact import Array

KEPT = 0.95
"""The trimmed root mean square leaves out the largest twentieth: a block that was knocked or lost weighs in the plain
one like twenty others (Huber 1981, Robust Statistics; tests/unit/simulators/test_figures.py shows the difference)."""


class Figure(NamedTuple):
    """A value and its standard error; both nan where there is nothing to sum up."""

    value: float
    sd: float


def mean(values: Array) -> Figure:
    """Returns the mean of the finite values (n,)."""
    known = values[np.isfinite(values)]
    sd = float(known.std(ddof=1)) / math.sqrt(len(known)) if len(known) > 1 else math.nan
    return Figure(float(known.mean()) if len(known) else math.nan, sd)


def rms(values: Array) -> Figure:
    """Returns the root mean square of values (n,), with its standard error from that of the mean square."""
    square = mean(values**2)
    root = math.sqrt(square.value) if square.value >= 0 else math.nan
    return Figure(root, 0.5 * square.sd / root if root > 0 else square.sd)


def trimmed_rms(values: Array) -> Figure:
    """Returns the root mean square of values (n,) without the largest twentieth.

    Its standard error is that of the kept values.
    """
    known = np.sort(np.abs(values[np.isfinite(values)]))
    return rms(known[: math.ceil(KEPT * len(known))])


def median(values: Array) -> Figure:
    """Returns the median of values (n,), with half the width of its 68 % interval by order statistics."""
    known = np.sort(values[np.isfinite(values)])
    if len(known) < 2:
        return Figure(float(known[0]) if len(known) else math.nan, math.nan)
    reach = 0.5 * math.sqrt(len(known))
    low, high = np.clip([0.5 * len(known) - reach, 0.5 * len(known) + reach - 1], 0, len(known) - 1)
    ends = np.interp([low, high], np.arange(len(known)), known)
    return Figure(float(np.median(known)), 0.5 * float(ends[1] - ends[0]))

"""The simplest filters of an arm's rates: rates that are late, and rates that lag.

A driver that reports each rate some time after it was, and one that smooths it with a lag of first order, are alike in
slow motions: either is late. A wrist that rings at 18 Hz loses a third of its rates behind a lag of 10 ms, and
nothing behind a delay. Of the two the diagnosis takes the one that makes attitudes and rates agree better; each has one
number.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from station.diagnosis.observations.cubics import spline_slopes
from station.physics.contact import Array

Form = Callable[[Array, Array, float, Sequence[slice]], tuple[Array, Array]]
"""Gives rates (n, 3) without a filter of so many seconds, and the rates (n, 3) by which their integral grows with that.

Its arguments are times (n,), s, the recorded rates (n, 3), the filter's seconds, and the stretches without a gap."""


def delayed(time_s: Array, rate: Array, by_s: float, parts: Sequence[slice]) -> tuple[Array, Array]:  # noqa: ARG001
    """Gives the `rate` (n, 3) at `time_s` (n,) before it was delayed by `by_s`, twice: w(t) = recorded(t + by)."""
    before = np.column_stack([np.interp(time_s + by_s, time_s, column) for column in rate.T])
    return before, before


def lagging(time_s: Array, rate: Array, by_s: float, parts: Sequence[slice]) -> tuple[Array, Array]:
    """Gives the `rate` (n, 3) at `time_s` (n,) before a lag of first order, w = recorded + by recorded', and itself."""
    return rate + by_s * derivative(rate, time_s, parts), rate


FORMS: tuple[Form, ...] = (delayed, lagging)


def derivative(values: Array, time_s: Array, parts: Sequence[slice]) -> Array:
    """Returns the slopes (n, k) of `values` (n, k) at times `time_s` (n,), s, by a cubic spline through each part."""
    return np.concatenate([spline_slopes(time_s[part], values[part]) for part in parts])

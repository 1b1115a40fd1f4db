"""Corrects the likelihood of rows that a model predicts from their own motion.

A window's friction, and the moment against its turning, are predicted at the speed and the rate that were recorded in
that window. But what nobody knows of its friction has changed these. A residual e = a + c v, of the accelerations a and
of friction that undoes c of the velocity v in a second, is then correlated with v, and minus its square over twice its
variance σ² has a slope by c of which the expectation is not zero at the true c: it falls with −E[e v] / σ². With
x = c Δt, by how much friction undoes a change within the window Δt, and dv / dt = e − c v,

    E[e v] / σ² = Δt (x − 1 + exp(−x)) / x²,

be e white or the same over the window. The log likelihood has the integral of that over c beside it,

    Ein(x) + (1 − exp(−x)) / x − 1,   Ein(x) = ∫ (1 − exp(−u)) / u du,

so that the true law has the slope zero (an unbiased estimating function: Godambe 1960, Ann. Math. Stat. 31, 1208). For
small x it is x / 2, the log of the Jacobian of e by a. Without it a law under which friction undoes less is likelier:
its residuals scatter less. Nulls of small blocks and of steep plates had a friction that falls with the speed by 2 to
5 % (.92 to .99), and one along one axis a plate anisotropy of .7 with a leading pressure of .46 widths (1.00; `pytest
-m benchmark -s tests/benchmarks/test_other_sessions.py`).

The errors of reading change no motion: it counts for the other share of a row's variance, given those before it. Where
a wander is too short for the windows to tell it from errors of reading, nothing tells these shares. The integral begins
at the decay that a block has under any model, such as that of its turning: a model that changes no decay owes nothing,
however the variance is shared. With an integral from zero the noise of one fit of a session was likelier by 147 nats
than that of another of the same law (`pytest tests/unit/diagnosis/test_feedback.py -k shared`).
"""

from __future__ import annotations

import numpy as np
from scipy.special import expi

from station.diagnosis.likelihood.whitening import Whitening
from station.physics.contact import Array

LINEAR = 1e-3
"""The size of x below which three terms of the series are exact to 1e-10."""


STEEPEST = -20.0
"""The least x, where exp(−x) is still far from the largest number: a law that falls so steeply fits nothing."""


def owed(whitening: Whitening, decay: Array, plain: Array | float = 0.0) -> Array:
    """Returns what is added to the log densities (rows,).

    By `decay` (rows,) friction undoes so often, within a row, what changes its motion, and by `plain` (rows,) under a
    model without effects.
    """
    return whitening.unread * (_gathered(decay) - _gathered(np.asarray(plain)))


def _gathered(decay: Array) -> Array:
    """Returns the integral (rows,) of the slopes from no decay to the `decay` (rows,)."""
    x = _away(decay)
    exact = np.euler_gamma + np.log(np.abs(x)) - expi(-x) - np.expm1(-x) / x - 1.0
    near = decay / 2.0 - decay**2 / 12.0 + decay**3 / 72.0
    return np.where(np.abs(decay) > LINEAR, exact, near)


def owed_slope(whitening: Whitening, decay: Array) -> Array:
    """Returns the slope (rows,) of what is `owed` by the `decay` (rows,)."""
    x = _away(decay)
    exact = (x + np.expm1(-x)) / x**2
    near = 0.5 - decay / 6.0 + decay**2 / 24.0
    return whitening.unread * np.where(np.abs(decay) > LINEAR, exact, near)


def _away(decay: Array) -> Array:
    """Returns the decay (rows,), and LINEAR where it is nearer to 0."""
    return np.where(np.abs(decay) > LINEAR, np.maximum(decay, STEEPEST), LINEAR)

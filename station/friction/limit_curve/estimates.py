"""Tells a fit's parameters in the field's words, with 90 % intervals by the delta method."""

from __future__ import annotations

import math
from collections.abc import Callable
from statistics import NormalDist
from typing import cast

import numpy as np

from station.friction.direction import Array
from station.friction.limit_curve.curve import LEVEL, Band, Estimate
from station.friction.limit_curve.maximise import Maximum
from station.friction.limit_curve.series import Evaluator
from station.friction.limit_curve.shape import LimitCurve

QUANTILE = NormalDist().inv_cdf((1 + LEVEL) / 2)
"""Standard errors to either side that hold 90 % of a normal distribution."""
_CIRCLE: Array = np.linspace(0, 2 * math.pi, 72, endpoint=False)
_FINE = 720
_STEP = 1e-4


def estimates_of(fit: Maximum) -> dict[str, Estimate]:
    """Returns everything that can be named (`LimitCurveFit.estimates`).

    Ratios and coefficients have intervals of their ln.
    """
    layout = fit.layout
    found = {
        "level": _positive(fit, lambda values: float(values[0])),
        "scatter": _positive(fit, lambda values: float(values[layout.index("log_scatter")])),
        "direction_scatter_rad": _positive(fit, lambda values: float(values[layout.index("log_direction_scatter")])),
        "drift": _plain(fit, lambda values: 2 * float(values[layout.index("drift")])),
        "turn_rad": _plain(fit, lambda values: float(values[layout.index("turn")])),
    }
    if layout.kind == "isotropic":
        return found
    found["ease"] = _plain(fit, lambda values: float(values[layout.index("ease")]))
    if layout.frame != "both":
        return found | _of_frame(fit, layout.frame, "")
    return found | _of_frame(fit, "object", "") | _of_frame(fit, "plate", "_plate")


def friction_at(fit: Maximum, phi_rad: float) -> Estimate:
    """Returns the friction of a slide in one direction of the frame (at the orientation 0 in the frame "both")."""
    _, mu, low, high = _columns(fit, np.array([phi_rad]))
    return Estimate(float(mu[0]), float(low[0]), float(high[0]))


def band_of(fit: Maximum) -> Band:
    """Returns the curve with its interval over the circle, at the orientation 0 in the frame "both"."""
    phi, mu, low, high = (tuple(row.tolist()) for row in _columns(fit, _CIRCLE))
    return Band(phi_rad=phi, mu=mu, low=low, high=high)


def _columns(fit: Maximum, phi: Array) -> tuple[Array, Array, Array, Array]:
    slopes = np.zeros((len(phi), len(fit.values)))
    slopes[:, 0] = 1.0
    frames = ("object", "plate") if fit.layout.frame == "both" else (fit.layout.frame,)
    for frame in frames:
        for number, series in fit.layout.slopes(fit.values, frame):
            slopes[:, number] = Evaluator([series], derivatives=1)(phi)[0, 0]
    mu = fit.layout.curve(fit.values).mu(phi)
    width = np.exp(QUANTILE * np.sqrt(np.maximum(((slopes @ fit.covariance) * slopes).sum(axis=1), 0.0)))
    return phi, mu, mu / width, mu * width


def _of_frame(fit: Maximum, frame: str, suffix: str) -> dict[str, Estimate]:
    layout = fit.layout

    def curve(values: Array) -> LimitCurve:
        return LimitCurve(level=math.exp(float(values[0])), frame="object", object=layout.shape(values, frame))

    found = {
        "mu_1": _positive(fit, lambda values: math.log(curve(values).ellipse().mu_1)),
        "mu_2": _positive(fit, lambda values: math.log(curve(values).ellipse().mu_2)),
        "ratio": _positive(fit, lambda values: _stretch(curve(values))),
        "axis_rad": _plain(fit, lambda values: curve(values).ellipse().axis_rad, turn=math.pi),
    }
    if layout.kind != "ellipse":
        for name, sign in (("highest", 1.0), ("lowest", -1.0)):
            at = _extreme(curve(fit.values), sign)
            # Where the curve is flat a small move of its extreme changes nothing.
            found[name] = _positive(fit, lambda values, at=at: math.log(float(curve(values).mu(at))))
            found[f"{name}_rad"] = Estimate(at, math.nan, math.nan)
        found["one_way"] = _positive(fit, lambda values: 2 * math.hypot(*layout.shape(values, frame).one_way))
        found["one_way_rad"] = _plain(fit, lambda values: _angle(layout.shape(values, frame).one_way), turn=2 * math.pi)
    return {name + suffix: estimate for name, estimate in found.items()}


def _stretch(curve: LimitCurve) -> float:
    ellipse = curve.ellipse()
    return math.log(ellipse.mu_1 / ellipse.mu_2)


def _angle(pair: tuple[float, float]) -> float:
    return math.atan2(pair[1], pair[0]) % (2 * math.pi)


def _extreme(curve: LimitCurve, sign: float) -> float:
    phi = np.arange(_FINE) * (2 * math.pi / _FINE)
    return float(phi[np.argmax(sign * curve.mu(phi))])


def _positive(fit: Maximum, log: Callable[[Array], float]) -> Estimate:
    """Returns a positive quantity, from its logarithm."""
    plain = _plain(fit, log)
    return Estimate(*(math.exp(value) for value in (plain.value, plain.low, plain.high)))


def _plain(fit: Maximum, of: Callable[[Array], float], *, turn: float | None = None) -> Estimate:
    """Returns a quantity; one that is an angle is continued over its turn."""
    value = of(fit.values)
    slope = np.zeros(len(fit.values))
    for number in np.flatnonzero(np.diag(fit.covariance) > 0):
        ahead, behind = fit.values.copy(), fit.values.copy()
        ahead[number] += _STEP
        behind[number] -= _STEP
        change = of(ahead) - of(behind)
        slope[number] = (change if turn is None else (change + turn / 2) % turn - turn / 2) / (2 * _STEP)
    width = QUANTILE * fit.sigma(cast(Array, slope))
    return Estimate(value, value - width, value + width)

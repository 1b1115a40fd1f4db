# ruff: noqa: PLR0917 (compiled functions take no keyword-only arguments)
"""The noise of rows in groups: each group's own level, the rows' scatter in it, and the wander of a continuous record.

A row of group g has the residual b_g + w + f e sigma, with b_g the group's random effect and w, where the rows follow
one another along a slip, an Ornstein-Uhlenbeck process of it. All sizes are those of the largest likelihood, which a
Kalman filter over (w, b) gives exactly (Durbin & Koopman 2012, Time Series Analysis by State Space Methods, ch. 4).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.optimize import minimize

from station.diagnosis import thresholds
from station.diagnosis.compiled import compiled
from station.diagnosis.likelihood.noise import Noise
from station.diagnosis.likelihood.wander import Wander
from station.diagnosis.observations.channel import Channel
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.pulled import SETTLING
from station.physics.contact import Array

STEPS = 200
"""The largest number of likelihood evaluations of the simplex search over two or four numbers."""

ANY = 1.0
"""The standard deviation of a level that is no evidence: that of friction which has not settled."""

LEAST = 1e-6
"""The smallest standard deviation, relative."""


def grouped_noise(evidence: Evidence, residuals: Mapping[str, Array]) -> Noise:
    """Estimates the noise of evidence with groups from residuals by channel; static and sliding rows apart."""
    own, factor, wander = dict[str, float](), dict[str, float](), dict[str, Wander]()
    for channel in evidence.channels:
        found = _sizes(evidence, channel, residuals[channel.name])
        factor[channel.name], own[channel.name] = found[0], ANY if channel.name == SETTLING else found[1]
        if channel.travelled_m is not None:
            wander[channel.name] = Wander(sd=found[2], reach_m=found[3])
    return Noise(
        friction=0.0, own=own, factor=factor, tail=dict.fromkeys(own, thresholds.GAUSSIAN), wander=wander
    )  # fmt: skip


def _sizes(evidence: Evidence, channel: Channel, residual: Array) -> tuple[float, float, float, float]:
    """Factor on the rows' errors, standard deviations of the groups' levels and of the wander, and its reach, m.

    One group has no level of its own: that is mu.
    """
    rows = channel.rows
    order = np.argsort(evidence.block[rows.run], kind="stable")
    order = order[~rows.limit[order]]
    if len(order) < thresholds.LEAST_KNOWN:
        return 1.0, LEAST, 0.0, 1.0
    block, sigma, values = evidence.block[rows.run][order], rows.sigma[order], residual[order]
    starts = np.diff(block, prepend=-1) != 0
    path = channel.travelled_m
    if path is None:
        values = _clipped(values, np.cumsum(starts) - 1)
    place = np.zeros(len(order)) if path is None else path[order]
    return _likeliest(values, sigma, place, starts, follows=path is not None)


def _clipped(values: Array, group: Array) -> Array:
    """The values (n,) clipped at WANDER_CLIP robust standard deviations from the medians of their groups."""
    middle = np.array([float(np.median(values[group == one])) for one in range(int(group[-1]) + 1)])[group]
    reach = thresholds.WANDER_CLIP * 1.4826 * float(np.median(np.abs(values - middle)))
    return middle + np.clip(values - middle, -reach, reach) if reach else values


def _likeliest(
    values: Array, sigma: Array, place_m: Array, starts: Array, *, follows: bool
) -> tuple[float, float, float, float]:
    spread = max(float(np.std(values)), LEAST)
    steps = np.diff(place_m)[~starts[1:]] if follows else place_m[:0]
    low, high = (float(np.median(steps)), thresholds.LONGEST_SHARE * float(place_m.max())) if len(steps) else (1.0, 1.0)

    def numbers(inner: Array) -> tuple[float, float, float, float]:
        error, own, sd = np.exp(np.clip(inner[:3], -12.0, 12.0)).tolist()
        share = 1.0 / (1.0 + math.exp(-min(max(float(inner[3]), -30.0), 30.0)))
        return error * spread, own * spread * (starts.sum() > 1), sd * spread * follows, low * (max(high, low) / low) ** share

    typical = float(np.median(sigma))

    def cost(inner: Array) -> float:
        error, own, sd, reach_m = numbers(_filled(inner))
        level = sigma * (error / typical)
        return float(_minus_log_likelihood(values, level, place_m, starts, own**2, sd**2, reach_m))

    begin = np.array([math.log(0.3), math.log(0.5), math.log(0.5), 0.0])[: 4 if follows else 2]
    corners = np.vstack([begin, begin + np.diag([-1.0, -1.0, -1.0, 1.5][: len(begin)])])
    found = minimize(
        cost,
        begin,
        method="Nelder-Mead",
        options={"maxfev": STEPS, "xatol": 0.02, "fatol": 0.02, "initial_simplex": corners},
    )
    error, own, sd, reach_m = numbers(_filled(np.asarray(found.x)))
    return max(error / typical, 1e-3), max(own, LEAST), sd, reach_m


def _filled(inner: Array) -> Array:
    """Four numbers, the wander's being any where there is none."""
    return np.append(inner, np.zeros(4 - len(inner)))


@compiled
def _minus_log_likelihood(
    values: Any, sigma: Any, place: Any, starts: Any, own: float, wander: float, reach_m: float
) -> float:
    """Minus the log likelihood of rows (n,) in groups that begin at `starts`; `own` and `wander` are variances."""
    total = 0.0
    w = b = p_ww = p_wb = p_bb = 0.0
    for i in range(len(values)):
        if starts[i]:
            w, b, p_ww, p_wb, p_bb = 0.0, 0.0, wander, 0.0, own
        else:
            kept = np.exp(-abs(place[i] - place[i - 1]) / reach_m)
            w *= kept
            p_ww, p_wb = kept * kept * p_ww + (1.0 - kept * kept) * wander, kept * p_wb
        variance = p_ww + 2.0 * p_wb + p_bb + sigma[i] ** 2 + 1e-30
        left = values[i] - w - b
        total += 0.5 * (left * left / variance + np.log(variance))
        of_w, of_b = (p_ww + p_wb) / variance, (p_wb + p_bb) / variance
        w, b = w + of_w * left, b + of_b * left
        p_ww, p_wb, p_bb = (
            p_ww - of_w * of_w * variance,
            p_wb - of_w * of_b * variance,
            p_bb - of_b * of_b * variance,
        )
    return total

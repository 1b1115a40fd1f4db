"""The noise of rows in groups: each group's own level, the rows' scatter in it, and the wander of a continuous record.

A row of group g has the residual b_g + w + s + f e sigma, with b_g the group's random effect, s the row's own, and w,
where the rows follow one another along a slip, an Ornstein-Uhlenbeck process of it. All sizes are those of the largest
likelihood (`wander.minus_log_likelihood`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import expit

from station.diagnosis import thresholds
from station.diagnosis.likelihood.noise import Noise
from station.diagnosis.likelihood.robust import clipped
from station.diagnosis.likelihood.wander import Wander, minus_log_likelihood, simplex
from station.diagnosis.observations.channel import Channel
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.pulled import SETTLING
from station.physics.contact import Array, Bools

STEPS = 300
"""The largest number of likelihood evaluations of the simplex search over three or five numbers."""

ANY = 1.0
"""The standard deviation of a level that is no evidence: that of friction which has not settled."""

LEAST = 1e-6
"""The smallest standard deviation, relative."""


def grouped_noise(evidence: Evidence, residuals: Mapping[str, Array]) -> Noise:
    """Estimates the noise of evidence with groups from residuals by channel; static and sliding rows apart."""
    own = {channel.name: _sizes(evidence, channel, residuals[channel.name]) for channel in evidence.channels}
    lent = _lent(evidence, own)
    found = {name: sizes or lent for name, sizes in own.items()}
    follow = {channel.name for channel in evidence.channels if channel.travelled_m is not None}
    return Noise(
        friction=0.0,
        own={name: sizes.row for name, sizes in found.items()},
        factor={name: sizes.factor for name, sizes in found.items()},
        tail=dict.fromkeys(found, thresholds.GAUSSIAN),
        group={name: ANY if name == SETTLING else sizes.group for name, sizes in found.items()},
        wander={name: Wander(sd=found[name].wander, reach_m=found[name].reach_m) for name in follow},
    )


@dataclass(frozen=True, kw_only=True)
class _Sizes:
    """Factor on the rows' errors, and standard deviations of the rows, of the groups' levels and of the wander."""

    factor: float = 1.0
    row: float = LEAST
    group: float = LEAST
    wander: float = 0.0
    reach_m: float = 1.0


def _lent(evidence: Evidence, own: Mapping[str, _Sizes | None]) -> _Sizes:
    """Returns the sizes for channels with too few rows to know their own: those of the channel with the most.

    It is the same contact, whose friction scatters and wanders on. Without them a few windows in which friction still
    settles would be as sure as their means, to 1e-4, and decide the search of the whole record.
    """
    longest = max(evidence.channels, key=len)
    return own[longest.name] or _Sizes()


def _sizes(evidence: Evidence, channel: Channel, residual: Array) -> _Sizes | None:
    """Returns the likeliest sizes; None for too few rows. One group has no level of its own: that is mu."""
    rows = channel.rows
    order = np.argsort(evidence.block[rows.run], kind="stable")
    order = order[evidence.known(channel)[order]]
    if len(order) < thresholds.LEAST_KNOWN:
        return None
    block, sigma, values = evidence.block[rows.run][order], rows.sigma[order], residual[order]
    starts = np.diff(block, prepend=-1) != 0
    path = channel.travelled_m
    if path is None:
        group = np.cumsum(starts) - 1
        middle = np.array([float(np.median(values[group == one])) for one in range(int(group[-1]) + 1)])
        values = clipped(values, thresholds.WANDER_CLIP, middle[group])
    place = None if path is None else np.asarray(path[order], dtype=np.float64)
    return _likeliest(values, sigma, place, starts)


def _likeliest(values: Array, sigma: Array, place_m: Array | None, starts: Bools) -> _Sizes:
    spread, typical = max(float(np.std(values)), LEAST), float(np.median(sigma))
    low, high = _reaches(place_m, starts)
    places = np.zeros(len(values)) if place_m is None else place_m

    def sizes(inner: Array) -> _Sizes:
        numbers = np.append(inner, np.full(5 - len(inner), -np.inf))
        error, row, group, wander = (spread * np.exp(np.clip(numbers[:4], -np.inf, 12.0))).tolist()
        return _Sizes(
            factor=max(error / typical, 1e-3),
            row=max(row, LEAST),
            group=max(group, LEAST) if starts.sum() > 1 else LEAST,
            wander=wander,
            reach_m=low * (high / low) ** float(expit(np.clip(numbers[4], -30.0, 30.0))),
        )

    def cost(inner: Array) -> float:
        one = sizes(inner)
        variance = (sigma * one.factor) ** 2 + one.row**2
        own, wander = one.group**2, one.wander**2
        return float(minus_log_likelihood(values, variance, places, starts, own, wander, one.reach_m, False))

    begin = np.log([0.3, 0.3, 0.5, 0.5, 1.0])[: 3 if place_m is None else 5]
    return sizes(simplex(cost, begin, np.array([-1.0, -1.0, -1.0, -1.0, 1.5])[: len(begin)], evaluations=STEPS))


def _reaches(place_m: Array | None, starts: Bools) -> tuple[float, float]:
    """Returns the shortest reach of a record's wander, that of its rows, and the longest, m.

    What goes on for longer is a trend, as of a law: it leaves too few stretches on their own to tell one.
    """
    if place_m is None or starts.all():
        return 1.0, 1.0
    low = max(float(np.median(np.diff(place_m)[~starts[1:]])), 1e-12)
    return low, max(float(place_m.max()) / thresholds.LEAST_SLID, low)

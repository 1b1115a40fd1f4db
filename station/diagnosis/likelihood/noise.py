"""The noise model: errors of the measurements, a random effect of each run, and friction that a run's channels share.

A row j of channel c in run i has the residual

    r_ij = f_c e_ij sigma_ij + b_ci + a_c u_i,

with e of unit scale, b_ci the channel's random effect of the run, and u_i the run's own friction (a_c = 1 in the
channels that it shifts); the onset's b is friction that the slide does not share. Whitened by the Cholesky factor of a
run's covariance, the components are Student-t.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.stats import norm

from station.diagnosis import thresholds
from station.diagnosis.likelihood.robust import clipped
from station.diagnosis.likelihood.wander import Wander, wanders
from station.diagnosis.observations.channel import ALONG, ONSET, Channel
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.plate import Times
from station.physics.contact import Array, Bools

TAILS = (3.0, 4.0, 6.0, 10.0, 20.0, thresholds.GAUSSIAN)
CENSORED_ROUNDS = 30


@dataclass(frozen=True, kw_only=True)
class Noise:
    """Standard deviations: `friction` is shared by onset and slide, `own` is each channel's random effect of a run.

    `factor` multiplies each channel's sigma, and `tail` is its degrees of freedom of Student's t. `group` is that of
    groups of rows, and `wander` that of friction along a path, by channel. `astray` is how much of what may lead rows
    astray does so, from 0 to 1, and `astray_tail` the degrees of freedom of these rows: a block that creeps may go a
    hundred times as far as the others. All are estimated anew with every model: what a late clock does to a slide looks
    like wander to a model without it.
    """

    friction: float
    own: Mapping[str, float]
    factor: Mapping[str, float]
    tail: Mapping[str, float]
    group: Mapping[str, float] = field(default_factory=dict[str, float])
    wander: Mapping[str, Wander] = field(default_factory=dict[str, Wander])
    astray: Mapping[str, float] = field(default_factory=dict[str, float])
    astray_tail: Mapping[str, float] = field(default_factory=dict[str, float])

    @property
    def scatter(self) -> float:
        """Relative standard deviation of a run's static friction; of its friction while sliding if it has no onset."""
        name = ONSET if ONSET in self.own else ALONG
        return math.hypot(self.friction, self.own.get(name, 0.0), self.group.get(name, 0.0))

    def of_reading(self, channel: Channel) -> Array:
        """Returns the variance (n,) of the rows' own errors: of their reading, and of what else may shift them."""
        rows, share = channel.rows, self.astray.get(channel.name, 1.0)
        return (self.factor[channel.name] * rows.sigma) ** 2 + (share * rows.astray) ** 2

    def tails_of(self, channel: Channel) -> Array:
        """Returns the degrees of freedom (n,) of the rows' components."""
        tail = self.tail[channel.name]
        return np.where(channel.rows.strayed, self.astray_tail.get(channel.name, tail), tail)

    def at_most(self, other: Noise) -> Noise:
        """Returns the smaller of both standard deviations and factors, one by one; the tails and the wander stay."""
        return replace(
            self,
            friction=min(self.friction, other.friction),
            own={name: min(own, other.own[name]) for name, own in self.own.items()},
            factor={name: min(factor, other.factor[name]) for name, factor in self.factor.items()},
            group={name: min(group, other.group[name]) for name, group in self.group.items()},
            astray={name: min(share, other.astray[name]) for name, share in self.astray.items()},
        )

    def at_least(self, floor: Noise) -> Noise:
        """Returns the larger of both standard deviations and factors, one by one; the tails stay."""
        larger = {
            name: one for name, one in self.wander.items() if name not in floor.wander or one.sd > floor.wander[name].sd
        }
        return Noise(
            friction=max(self.friction, floor.friction),
            own={name: max(own, floor.own.get(name, 0.0)) for name, own in self.own.items()},
            factor={name: max(factor, floor.factor.get(name, 0.0)) for name, factor in self.factor.items()},
            tail=self.tail,
            astray_tail=self.astray_tail,
            group={name: max(group, floor.group.get(name, 0.0)) for name, group in self.group.items()},
            wander={**floor.wander, **larger},
            astray={name: max(share, floor.astray.get(name, 0.0)) for name, share in self.astray.items()},
        )


def estimate_noise(evidence: Evidence, residuals: Mapping[str, Array]) -> Noise:
    """Estimates the noise from residuals by channel with robust moments: within and between runs, between channels.

    Only the runs that count are looked at.
    """
    wandering = wanders(evidence, residuals)
    own, factor = dict[str, float](), dict[str, float]()
    means, errors = dict[str, Array](), dict[str, Array]()
    for channel in evidence.channels:
        values, rows = residuals[channel.name], channel.rows
        known = evidence.known(channel)
        wander = wandering.get(channel.name)
        place = None if wander is None or channel.travelled_m is None else channel.travelled_m[known]
        more = 0.0 if wander is None or place is None else _wandering(wander, place, rows.sigma[known], rows.run[known])
        factor[channel.name] = math.sqrt(
            max(_factor(values[known], rows.sigma[known], rows.run[known]) ** 2 - more, 0.25)
        )
        mean, error = run_means(values[known], factor[channel.name] * rows.sigma[known], rows.run[known], evidence.runs)
        if wander is not None and place is not None:
            error = np.hypot(error, _of_means(wander, place, rows.run[known], evidence.runs))
        means[channel.name], errors[channel.name] = mean, error
        own[channel.name] = _between(mean, error)
    if (onsets := evidence.onsets) is not None:
        # Runs without a slide are the upper tail: without them the scatter would be underestimated.
        counted = evidence.counted[onsets.rows.run]
        own[ONSET] *= _censoring(residuals[ONSET][counted], onsets.rows.limit[counted])
    friction = _share(means, errors, own)
    tail = dict.fromkeys(own, thresholds.GAUSSIAN)
    astray = {channel.name: _astray(evidence, channel, residuals[channel.name]) for channel in evidence.channels}
    return Noise(friction=friction, own=own, factor=factor, tail=tail, wander=wandering, astray=astray)


def _astray(evidence: Evidence, channel: Channel, values: Array) -> float:
    """Returns the share of what may lead a channel's rows astray that their residuals (n,) show, at most all of it.

    Blocks that creep towards their limits for no told reason do so by orders of magnitude less in one session than in
    another, and a law of creep explains little of what any creep might.
    """
    rows = channel.rows
    far = (rows.astray > thresholds.CLIP * rows.sigma) & evidence.counted[rows.run]
    if np.count_nonzero(far) < thresholds.LEAST_KNOWN:
        return 1.0
    shares = values[far] / rows.astray[far]
    return min(float(np.sqrt(np.mean(np.square(clipped(shares, thresholds.CLIP, np.zeros(len(shares))))))), 1.0)


def _factor(values: Array, sigma: Array, run: Times) -> float:
    """Returns the ratio of the scatter of successive rows' differences to what their sigma says; not below a half."""
    if len(values) < 4:
        return 1.0
    same = run[1:] == run[:-1]
    if same.sum() < 10:
        return 1.0
    first, second = values[1:][same], values[:-1][same]
    standardised = (first - second) / np.hypot(sigma[1:][same], sigma[:-1][same])
    return max(_robust_sd(standardised), 0.5)


def _wandering(wander: Wander, place_m: Array, sigma: Array, run: Times) -> float:
    """Gives the wander's median share of the variance of successive rows' differences, standardised as in `_factor`."""
    same = run[1:] == run[:-1]
    if not same.any():
        return 0.0
    apart = 2.0 * (wander.sd**2 - wander.shared(np.diff(place_m)[same]))
    return float(np.median(apart / (sigma[1:][same] ** 2 + sigma[:-1][same] ** 2)))


def _of_means(wander: Wander, place_m: Array, run: Times, runs: int) -> Array:
    """Returns the standard deviation (runs,) of the wander's mean over each run's rows."""
    found = np.zeros(runs)
    for one in np.unique(run):
        mine = place_m[run == one]
        found[one] = math.sqrt(float(wander.shared(mine[:, None] - mine[None, :]).mean()))
    return found


def run_means(values: Array, sigma: Array, run: Times, runs: int) -> tuple[Array, Array]:
    """Returns the weighted mean of each run (runs,) and its standard error (runs,); nan for a run without rows.

    `values` (n,) have the standard deviations `sigma` (n,) in the same unit, and `run` (n,) has the index of each
    row's run, below `runs`.
    """
    weight = 1.0 / np.maximum(sigma, 1e-12) ** 2
    total = np.bincount(run, weight, runs)
    summed = np.bincount(run, weight * values, runs)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(total > 0, summed / total, np.nan), np.where(total > 0, 1 / np.sqrt(total), np.nan)


def _between(mean: Array, error: Array) -> float:
    """Returns the standard deviation of the runs' random effects, from their means (runs,) and their errors (runs,)."""
    known = np.isfinite(mean)
    if known.sum() < 4:
        return 1e-6
    spread = _robust_sd(mean[known])
    return math.sqrt(max(spread**2 - float(np.median(error[known])) ** 2, 1e-12))


def _robust_sd(values: Array) -> float:
    """Returns the standard deviation of clipped values, corrected for what the clipping takes from a Gaussian."""
    return float(np.std(clipped(values, thresholds.CLIP))) / 0.9933


def _censoring(values: Array, limit: Bools) -> float:
    """Returns the ratio of the scatter of all runs to that of the runs that slid.

    The others are right-censored at their `limit`.

    It is the maximum likelihood of a censored Gaussian by expectation and maximisation (Tobin 1958, Econometrica 26,
    24; Dempster, Laird, Rubin 1977).
    """
    if not limit.any() or (~limit).sum() < thresholds.LEAST_KNOWN:
        return 1.0
    slid = clipped(values[~limit], thresholds.CLIP)
    plain = max(float(np.std(slid)), 1e-9)
    mean, scale = float(np.mean(slid)), plain
    for _ in range(CENSORED_ROUNDS):
        beyond = (values[limit] - mean) / scale
        hazard = np.exp(norm.logpdf(beyond) - norm.logsf(beyond))
        expected = mean + scale * hazard
        square = scale**2 * (1.0 + beyond * hazard - hazard**2)
        everything = np.concatenate([slid, expected])
        mean = float(np.mean(everything))
        scale = math.sqrt(float(np.sum((everything - mean) ** 2) + np.sum(square)) / len(everything))
    return min(max(scale / plain, 1.0), thresholds.MOST_CENSORED)


def _share(means: Mapping[str, Array], errors: Mapping[str, Array], own: dict[str, float]) -> float:
    """Returns the standard deviation of friction that onset and slide share; what each has besides is written to `own`.

    The difference of the two in the same run determines precisely what they do not share; a covariance of two large
    scatters would not.
    """
    if ONSET not in means or ALONG not in means:
        return 0.0
    both = np.isfinite(means[ONSET]) & np.isfinite(means[ALONG])
    if both.sum() < thresholds.LEAST_KNOWN:
        return 0.0
    apart = _robust_sd(means[ONSET][both] - means[ALONG][both]) ** 2
    apart = max(apart - float(np.median(errors[ALONG][both])) ** 2, 1e-10)
    first, second = own[ONSET] ** 2, own[ALONG] ** 2
    of_onset = min(max(0.5 * (first - second + apart), 0.02 * apart), 0.98 * apart, first)
    of_along = max(apart - of_onset, 1e-12)
    own[ONSET], own[ALONG] = math.sqrt(of_onset), math.sqrt(of_along)
    # Both channels tell what is shared; they differ where an onset's stated error is larger than the runs' scatter.
    return math.sqrt(max(0.5 * (first - of_onset + second - of_along), 0.0))

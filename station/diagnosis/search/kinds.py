"""Infers whether the runs are of two kinds: friction at two levels, and nothing recorded that says which run has which.

A grain under the block, a drop of oil, a block that was put back the wrong way round: such a cause acts in some runs
and not in others, by chance. It leaves no trace against any covariate, and the noise model takes it for scatter. Each
run's friction beyond the model (of onset and slide, each by its precision) has one of two densities here: a scatter
with one peak, as lopsided and as long or short in its tails as it likes (`likelihood/one_peak.py`), or two normal
distributions with one spread (`likelihood/mixture.py`). The ratio of their likelihoods has no known distribution where
there is one kind, so it is drawn from the fitted scatter. Two kinds are meant where the density has two peaks: two
normal distributions that overlap are fitted to many a shape. A few runs are outliers, which the noise's tails have (of
200 sessions of a hundred runs with a t of three degrees of freedom 11 have one to three that would be a kind). Two
kinds are a further finding, whose p is to be as small.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.inference.fit import Fit
from station.diagnosis.likelihood.mixture import Mixture, two_normal
from station.diagnosis.likelihood.noise import run_means
from station.diagnosis.likelihood.one_peak import OnePeak, one_peak
from station.diagnosis.observations.channel import Channel
from station.diagnosis.observations.covariates import KIND
from station.diagnosis.observations.evidence import Evidence, Index
from station.diagnosis.result import Combination, EffectFound, Located, Stretch
from station.diagnosis.search.beside import Beside
from station.diagnosis.search.locate import MOST_RUNS, MOST_WINDOWS
from station.diagnosis.search.posterior import probability_of
from station.physics.contact import Array, Bools

NAMED = 12
"""The most runs that a sentence names."""


def kinds_of_runs(evidence: Evidence, fitted: Fit, rng: np.random.Generator) -> Beside | None:
    """Returns the two kinds of runs if they are likelier than one, and beyond chance; None otherwise.

    Where rows have groups, whose levels differ, no kinds are sought.
    """
    values = friction_of_runs(evidence, fitted)
    runs = np.flatnonzero(np.isfinite(values))
    if evidence.group is not None or len(runs) < thresholds.LEAST_SCALED:
        return None
    told = told_apart(values[runs], rng)
    return None if told is None else _found(evidence, values, runs, told)


def friction_of_runs(evidence: Evidence, fitted: Fit) -> Array:
    """Returns each run's relative friction (runs,) beyond the model, from all channels that share it; else nan."""
    weight, total = np.zeros(evidence.runs), np.zeros(evidence.runs)
    for channel in evidence.channels:
        if channel.shares_friction:
            known, rows = evidence.known(channel), channel.rows
            sigma = fitted.noise.factor[channel.name] * rows.sigma[known]
            mean, error = run_means(channel.residual(fitted.model)[known], sigma, rows.run[known], evidence.runs)
            precision = np.where(np.isfinite(mean), 1.0 / (error**2 + fitted.noise.own[channel.name] ** 2), 0.0)
            weight, total = weight + precision, total + precision * np.where(np.isfinite(mean), mean, 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(weight > 0.0, total / weight, np.nan)


@dataclass(frozen=True, eq=False)
class ToldApart:
    """The runs (n,) that are of the rarer kind, as a mask, and the probability of two kinds."""

    other: Bools
    probability: float


def told_apart(values: Array, rng: np.random.Generator) -> ToldApart | None:
    """Returns the two kinds of a session's runs by their friction `values` (n,), a logarithm; None if they are of one.

    Both densities have four numbers, so that their likelihoods are compared as they are. `rng` draws sessions of one
    kind.
    """
    two, one = _both(values)
    more = 2.0 * (two.log_likelihood - one.log_likelihood)
    probability = probability_of(more + 2.0 * math.log(thresholds.OTHER / thresholds.NONE))
    if probability <= thresholds.EVEN or not two.has_two_peaks():
        return None
    other = two.of_other(values) > thresholds.EVEN
    rarer = ~other if 2 * other.sum() > len(values) else other
    if rarer.sum() < thresholds.LEAST_KNOWN or _is_by_chance(more, one, len(values), rng):
        return None
    return ToldApart(rarer, probability)


def _both(values: Array) -> tuple[Mixture, OnePeak]:
    return two_normal(values, least=thresholds.LEAST_KNOWN / len(values)), one_peak(values)


def _is_by_chance(more: float, one: OnePeak, runs: int, rng: np.random.Generator) -> bool:
    """Returns true if two kinds are likelier by so much in any of the drawn sessions of one kind.

    There are as many as it takes to say that p is at most NEXT; that takes seconds, where two kinds are likelier.
    """
    drawn = (_both(one.drawn(runs, rng)) for _ in range(round(1.0 / thresholds.NEXT) - 1))
    return any(2.0 * (two.log_likelihood - single.log_likelihood) >= more for two, single in drawn)


def _found(evidence: Evidence, values: Array, runs: Index, told: ToldApart) -> Beside:
    """Returns the finding from the friction `values` (r,) of the recording's runs and the numbers `runs` (n,) known."""
    friction, other = values[runs], told.other
    change = float(friction[other].mean() - friction[~other].mean())
    much = f"{abs(100.0 * math.expm1(change)):.2g} % {'more' if change > 0 else 'less'} friction than the others"
    number = evidence.run_number[runs[other]].astype(int).tolist()
    words = f"runs {', '.join(map(str, number[:NAMED]))}{', …' if len(number) > NAMED else ''} have {much}"
    step = math.sqrt(other.mean() * (1.0 - other.mean())) * abs(change) / float(np.std(friction))
    places = tuple(
        _place(evidence, channel, runs[other], words, size=min(step, 1.0))
        for channel in evidence.channels
        if channel.shares_friction
    )
    note = f"nothing recorded says why {words}: their pictures, or what lay under the block, may"
    effect = _effect(friction, told, change, much)
    return Beside(effects=(effect,), places=places, p=float(thresholds.NEXT), notes=(note,))


def _effect(friction: Array, told: ToldApart, change: float, much: str) -> EffectFound:
    """Returns the effect from the runs' friction (n,), by which the rarer kind differs by `change`, `much` in words."""
    other, some = told.other, f"{told.other.sum()} of {len(friction)}"
    among = float(np.var(np.where(other, friction - change, friction)))
    sd = math.sqrt(among / other.sum() + among / (~other).sum())
    by = Combination(
        expression=f"friction in {some} runs against the others, less 1",
        value=math.expm1(change),
        sd=math.exp(change) * sd,
        unit="1",
    )
    return EffectFound(
        id="other",
        title=f"two kinds of runs ({some} have {much}, and nothing recorded says which)",
        class_ids=("other",),
        probability=told.probability,
        verdict="supported",
        parameters={},
        determined=(by,),
        other_by="kind of run",
    )


def _place(evidence: Evidence, channel: Channel, runs: Index, words: str, *, size: float) -> Located:
    """Returns the place of the rarer kind's `runs` (n,) in a channel."""
    rows = channel.rows
    mine = np.flatnonzero(np.isin(rows.run, runs))
    number = evidence.run_number[rows.run[mine]].astype(int).tolist()
    stretches = zip(number, rows.from_ns[mine].tolist(), rows.to_ns[mine].tolist(), strict=True)
    windows = tuple(Stretch(run=run, from_ns=begin, to_ns=end) for run, begin, end in stretches)
    return Located(
        phase=channel.phase,
        covariate=KIND,
        channel=channel.name,
        effect_size=size,
        p=float(thresholds.NEXT),
        tested="kinds of runs",
        runs=tuple(dict.fromkeys(number))[:MOST_RUNS],
        windows=windows[:MOST_WINDOWS],
        summary=f"{channel.phase}: {words}",
    )

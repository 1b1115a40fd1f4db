"""Infers whether the block topples from the steepness of the runs in which it turned over and in which it stood.

A block stands up to a steepness s of its own, tan(tilt) times the cosine of the descent's angle to its nearest edge's
normal; s is its width over its height, 1 / slenderness. The alternative is that a run was called toppled by mistake (a
glare, a hand), at any moment of its tilt. Both give every run's outcome a probability, so their marginal likelihoods
are sums over a grid of the unknowns: s, its scatter from run to run (the block does not lie exactly as it is seen), and
the rate of mistakes.

The evidence of friction does not bear on it (there a run that toppled only says that its friction was larger), so the
two are tested separately.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp
from scipy.stats import norm

from station.diagnosis import thresholds
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.tips import Tips
from station.diagnosis.result import EffectFound, Located, Stretch, Value
from station.diagnosis.search.locate import MOST_RUNS, MOST_WINDOWS
from station.physics.contact import Array
from station.physics.effect import Effect

STEEPNESS: Array = np.geomspace(0.1, 10.0, 461)
"""The grid of s, in steps of one per cent."""

SCATTERS: Array = thresholds.WIDEST_TIP * np.array([0.125, 0.25, 0.5, 1.0])
MISTAKES: Array = np.append(np.array([1e-4, 1e-3, 1e-2]), thresholds.MOST_MISTAKEN)
SHIFTED = 1e-3
"""The smallest relative width of the interval of steepness in which a fall is placed."""


@dataclass(frozen=True, kw_only=True)
class Tipping:
    """The log Bayes factor that the block topples, and its slenderness with its standard error."""

    log_factor: float
    slenderness: float
    sd: float

    def probability(self, prior: float) -> float:
        """Posterior probability that it topples, for a prior probability between 0 and 1."""
        odds = self.log_factor + np.log(prior / (1.0 - prior))
        return float(1.0 / (1.0 + np.exp(-np.clip(odds, -700.0, 700.0))))

    @property
    def p(self) -> float:
        """An upper bound on the probability of so large a factor by mistakes alone (Markov's inequality)."""
        return float(np.exp(-max(self.log_factor, 0.0)))


def tipping(tips: Tips) -> Tipping | None:
    """The evidence of the runs; None if no block was seen to topple."""
    if not tips.tipped.any():
        return None
    by_mistake = float(np.asarray(logsumexp(_mistaken(tips)))) - float(np.log(len(MISTAKES)))
    table = _tipping(tips)
    weight = np.exp(table - logsumexp(table)).sum(axis=(1, 2))
    values = 1.0 / STEEPNESS
    mean = float(weight @ values)
    spread = float(np.sqrt(max(weight @ (values - mean) ** 2, 0.0)))
    grain = mean * float(np.log(STEEPNESS[1] / STEEPNESS[0])) / np.sqrt(12.0)
    factor = float(np.asarray(logsumexp(table))) - float(np.log(table.size)) - by_mistake
    return Tipping(log_factor=factor, slenderness=mean, sd=float(np.hypot(spread, grain)))


def _mistaken(tips: Tips) -> Array:
    """Log likelihood (mistakes,) of a block that never topples."""
    fallen = tips.tipped
    share = _share(tips)[:, None]
    chances = np.where(fallen[:, None], MISTAKES * share, 1.0 - MISTAKES)
    return np.log(chances).sum(axis=0)


def _tipping(tips: Tips) -> Array:
    """Log likelihood (s, scatters, mistakes) of a block that topples at a steepness s."""
    total = np.zeros((len(STEEPNESS), len(SCATTERS), len(MISTAKES)))
    for low, high, share, fell in zip(tips.stood, _fallen_by(tips), _share(tips), tips.tipped, strict=True):
        standing = _stands(low)
        falls = standing - _stands(high) if fell else np.zeros_like(standing)
        for place, mistake in enumerate(MISTAKES.tolist()):
            if fell:
                chance = (1 - mistake) * falls + mistake * share * standing
            else:
                chance = (1 - mistake) * standing + mistake * (1 - standing)
            total[:, :, place] += np.log(np.maximum(chance, 1e-300))
    return total


def _fallen_by(tips: Tips) -> Array:
    """The steepness (r,) at which each block had fallen; for one that stood, the largest."""
    return np.where(tips.tipped, np.maximum(tips.fallen, tips.stood * (1.0 + SHIFTED)), tips.stood)


def _share(tips: Tips) -> Array:
    """The share (r,) of its steepness over which a block fell: a mistake would have had to happen there, too."""
    high = _fallen_by(tips)
    return np.where(tips.tipped, np.clip((high - tips.stood) / np.maximum(high, 1e-9), SHIFTED, 1.0), 1.0)


def _stands(steepness: float) -> Array:
    """Probability (s, scatters) that a block stands at a steepness."""
    off = np.log(STEEPNESS[:, None] / max(steepness, 1e-3)) / SCATTERS
    return np.asarray(norm.cdf(off), dtype=np.float64)


@dataclass(frozen=True, kw_only=True)
class Tipped:
    """The finding that a block topples."""

    effect: EffectFound
    place: Located
    p: float


def tipped_over(evidence: Evidence, effect: Effect | None, *, prior: float) -> Tipped | None:
    """The finding that the block topples; None if mistakes are likelier, or if the effect was left out.

    Args:
        evidence: the recording's.
        effect: the catalogue's effect, None if it was left out.
        prior: its prior probability.
    """
    found = tipping(evidence.tips) if effect is not None else None
    if effect is None or found is None or found.probability(prior) < thresholds.EVEN:
        return None
    return Tipped(effect=_effect(effect, found, prior), place=_place(evidence, found), p=found.p)


def shows_tipping(evidence: Evidence, effect: Effect) -> bool:
    """True if a block as slender as the effect allows would have toppled in some run."""
    return bool(len(evidence.tips)) and float(evidence.tips.stood.max()) * effect.parameters[0].high > 1.0


def _effect(effect: Effect, found: Tipping, prior: float) -> EffectFound:
    (slenderness,) = effect.parameters
    return EffectFound(
        id=effect.id,
        title=effect.title,
        class_ids=(effect.id,),
        probability=found.probability(prior),
        verdict="supported",
        parameters={
            slenderness.name: Value(value=slenderness.clipped(found.slenderness), sd=found.sd, unit=slenderness.unit)
        },
        separated_by=effect.separated_by,
    )


def _place(evidence: Evidence, found: Tipping) -> Located:
    tips = evidence.tips
    fallen = np.flatnonzero(tips.tipped)
    runs = evidence.run_number[tips.run[fallen]].astype(int).tolist()
    windows = tuple(
        Stretch(run=run, from_ns=int(tips.from_ns[row]), to_ns=int(tips.to_ns[row]))
        for run, row in zip(runs, fallen.tolist(), strict=True)
    )
    tilt_deg = np.degrees(np.arctan(1.0 / found.slenderness))
    return Located(
        phase="pre-slip",
        covariate="tilt",
        channel="rest",
        effect_size=len(fallen) / len(tips),
        p=found.p,
        runs=tuple(sorted(runs))[:MOST_RUNS],
        windows=windows[:MOST_WINDOWS],
        summary=f"pre-slip: the block tips over along an edge at {tilt_deg:.1f}°, in {len(fallen)} of {len(tips)} runs",
    )

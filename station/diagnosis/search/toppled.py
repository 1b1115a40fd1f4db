"""Infers where the block's mass is from the steepness of the runs in which it toppled and in which it stood.

A block topples over the edge with the outward normal n where tan(tilt) · cos(angle from n to the descent) passes
(1 / 2 − b · n) / h, its mass being at b along the sole and at h above it, in widths of the sole (`physics/topple`).
Each effect that says where the mass is (`Effect.mass`) is in the model or not. The alternative is that a run was called
toppled by mistake (a glare, a hand), at any moment of its tilt. All models give every run's outcome a probability, and
are compared by their evidence, with a scatter of the block's limit from run to run (it does not lie exactly as it is
seen) and the rate of mistakes as unknowns of each.

The evidence of friction does not bear on it (there a run that toppled only says that its friction was larger), so the
two are tested separately.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, combinations

import numpy as np
from scipy.special import log_ndtr, logsumexp

from station.diagnosis import thresholds
from station.diagnosis.inference.tempered import Posterior, tempered
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.tips import Tips
from station.diagnosis.result import EffectFound, Located, Stretch, Value
from station.diagnosis.search.beside import Beside
from station.diagnosis.search.locate import MOST_RUNS, MOST_WINDOWS
from station.physics.contact import Array, Contact
from station.physics.effect import Effect
from station.physics.parameter import Parameter
from station.physics.topple import toppling_load

SCATTER = (0.125 * thresholds.WIDEST_TIP, float(thresholds.WIDEST_TIP))
MISTAKES = (1e-4, float(thresholds.MOST_MISTAKEN))
SHIFTED = 1e-3
"""The smallest relative width of the interval of steepness in which a fall is placed."""

Together = tuple[Effect, ...]


@dataclass(frozen=True, eq=False)
class Masses:
    """The models of where the mass is, by the effects that act in each, and their log odds against mistakes alone."""

    posteriors: dict[Together, Posterior]
    log_odds: dict[Together, float]

    def probability(self, effect: Effect) -> float:
        """Returns the posterior probability that an effect acts."""
        return sum(share for models, share in self._shares() if effect in models)

    def likeliest(self) -> Together:
        """Returns the model of those effects that rather act than not."""
        every = set(chain.from_iterable(self.log_odds))
        acting = {effect for effect in every if self.probability(effect) > thresholds.EVEN}
        return next((models for models in self.posteriors if set(models) == acting), ())

    @property
    def p(self) -> float:
        """An upper bound on the probability of so large a factor by mistakes alone (Markov's inequality)."""
        best = max(one.log_evidence for models, one in self.posteriors.items() if models)
        several = np.log(max(len(self.posteriors) - 1, 1))
        return float(np.exp(-max(best - several - self.posteriors[()].log_evidence, 0.0)))

    def _shares(self) -> Iterator[tuple[Together, float]]:
        total = float(np.asarray(logsumexp(list(self.log_odds.values()))))
        return ((models, float(np.exp(odds - total))) for models, odds in self.log_odds.items())


def acting_on_mass(effects: Sequence[Effect]) -> Together:
    """Returns the effects that say where the block's mass is."""
    return tuple(effect for effect in effects if "mass" in effect.acts_through())


def masses(
    tips: Tips, effects: Sequence[Effect], block: Contact, *, prior: float, rng: np.random.Generator
) -> Masses | None:
    """Returns the models of all combinations of the effects that act on the mass; None if no block was seen to topple.

    Args:
        tips: the runs in which blocks stood or toppled.
        effects: the catalogue's.
        block: a contact (1,) of the block.
        prior: the prior probability of each effect.
        rng: draws the samples of the posteriors.
    """
    acting = acting_on_mass(effects)
    if not tips.tipped.any() or not acting:
        return None
    some = [one for size in range(1, len(acting) + 1) for one in combinations(acting, size)]
    every = [(), *(one for one in some if _may_topple(tips, one, block))]
    posteriors = {one: _posterior(tips, one, block, rng) for one in every}
    prior_odds = float(np.log(prior / (1.0 - prior)))
    none = posteriors[()].log_evidence
    odds = {some: one.log_evidence - none + len(some) * prior_odds for some, one in posteriors.items()}
    return Masses(posteriors, odds)


def _may_topple(tips: Tips, effects: Together, block: Contact) -> bool:
    """Returns true if the block leans towards an edge at all, with the effects at their upper bounds.

    A flat one never does.
    """
    highest = {one.name: one.high for one in numbers_of(effects)}
    return bool(np.any(toppling_load(tips.stood, _mass(effects, block, highest)[None, :]) > 0.0))


def numbers_of(effects: Together) -> tuple[Parameter, ...]:
    """Returns the numbers that effects on the mass need; those of one name are one number of the block."""
    sizes = {one.name: one for effect in effects for one in effect.parameters if not one.is_shape}
    return tuple(sizes.values())


def _posterior(tips: Tips, effects: Together, block: Contact, rng: np.random.Generator) -> Posterior:
    numbers = numbers_of(effects)
    low, high = np.log([SCATTER, MISTAKES]).T

    def log_likelihood(draws: Array) -> Array:
        place = np.array([_mass(effects, block, _named(numbers, draw)) for draw in draws.tolist()])
        return _log_likelihood(tips, place, *np.exp(draws[:, -2:]).T)

    return tempered(
        log_likelihood,
        np.concatenate([[one.low for one in numbers], low]),
        np.concatenate([[one.high for one in numbers], high]),
        rng,
    )


def _named(numbers: Sequence[Parameter], draw: Sequence[float]) -> dict[str, float]:
    return {one.name: value for one, value in zip(numbers, draw, strict=False)}


def _values(effect: Effect, known: dict[str, float]) -> dict[str, float]:
    """Returns all values of an effect: those that are known, and its shapes where they start."""
    return {**effect.neutral(), **{one.name: known[one.name] for one in effect.parameters if one.name in known}}


def _mass(effects: Together, block: Contact, known: dict[str, float]) -> Array:
    total = np.zeros(3)
    for effect in effects:
        place = effect.mass(block, _values(effect, known))
        if place is not None:
            total += place[0]
    return total


def _log_likelihood(tips: Tips, mass: Array, scatter: Array, mistake: Array) -> Array:
    """Returns the log likelihood (m,) of all runs for masses (m, 3), scatters and rates of mistakes (m,)."""
    stood = _log_stands(toppling_load(tips.stood, mass), scatter)
    wrong = np.log(mistake)[:, None] + np.log(_share(tips))
    right = np.log1p(-mistake)[:, None]
    fell = tips.tipped
    later = _log_stands(toppling_load(_fallen_by(tips)[fell], mass), scatter)
    between = stood[:, fell] + np.log(-np.expm1(np.minimum(later - stood[:, fell], -1e-300)))
    fallen = np.logaddexp(right + between, wrong[:, fell] + stood[:, fell])
    standing = stood[:, ~fell]
    unseen = np.log(-np.expm1(np.minimum(standing, -1e-300))) + np.log(mistake)[:, None]
    return fallen.sum(axis=1) + np.logaddexp(right + standing, unseen).sum(axis=1)


def _log_stands(load: Array, scatter: Array) -> Array:
    """Returns the log probability (m, r) that a block stands under loads (m, r) of which it holds about 1."""
    off = -np.log(np.maximum(load, 1e-9)) / scatter[:, None]
    return np.asarray(log_ndtr(np.maximum(off, -1e4)), dtype=np.float64)


def _fallen_by(tips: Tips) -> Array:
    """Returns the steepness (r, 4) at which each block had fallen."""
    return np.fmax(tips.fallen, tips.stood * (1.0 + SHIFTED))


def _share(tips: Tips) -> Array:
    """Gives the share (r,) of its steepness over which a block fell: a mistake would have had to happen there, too."""
    high, low = _fallen_by(tips).max(axis=1), tips.stood.max(axis=1)
    return np.where(tips.tipped, np.clip((high - low) / np.maximum(high, 1e-9), SHIFTED, 1.0), 1.0)


def toppled(evidence: Evidence, effects: Sequence[Effect], *, prior: float, rng: np.random.Generator) -> Beside | None:
    """Gives the finding that the block topples; None if mistakes are likelier, or if no effect says where the mass is.

    Args:
        evidence: the recording's.
        effects: the catalogue's.
        prior: the prior probability of each effect.
        rng: draws the samples of the posteriors.
    """
    contact = evidence.contact()
    if contact is None:
        return None
    found = masses(evidence.tips, effects, contact.chosen(np.zeros(1, dtype=np.int64)), prior=prior, rng=rng)
    named = found.likeliest() if found is not None else ()
    if found is None or not named:
        return None
    seen = tuple(_found(found, effect, named) for effect in named)
    return Beside(effects=seen, places=(_place(evidence, found.p),), p=found.p)


def shows_toppling(evidence: Evidence, effect: Effect) -> bool:
    """Returns true if a block toppled, or would have with the mass as far off as the effect allows."""
    contact = evidence.contact()
    if "mass" not in effect.acts_through() or contact is None or not len(evidence.tips):
        return False
    block = contact.chosen(np.zeros(1, dtype=np.int64))
    farthest = _mass((effect,), block, {one.name: one.high for one in effect.parameters})
    loads = toppling_load(evidence.tips.stood, farthest[None, :])
    return bool(evidence.tips.tipped.any() or np.any(loads > 1.0))


def _found(found: Masses, effect: Effect, named: Together) -> EffectFound:
    numbers, posterior = numbers_of(named), found.posteriors[named]
    mean, sd = posterior.mean().tolist(), posterior.sd().tolist()
    errors = _named(numbers, sd)
    values = _values(effect, _named(numbers, mean))
    return EffectFound(
        id=effect.id,
        title=effect.title,
        class_ids=(effect.id,),
        probability=found.probability(effect),
        verdict="supported",
        parameters={
            one.name: Value(value=one.clipped(values[one.name]), sd=errors.get(one.name, np.nan), unit=one.unit)
            for one in effect.parameters
        },
        separated_by=effect.separated_by,
    )


def _place(evidence: Evidence, p: float) -> Located:
    tips = evidence.tips
    fallen = np.flatnonzero(tips.tipped)
    runs = evidence.run_number[tips.run[fallen]].astype(int).tolist()
    windows = tuple(
        Stretch(run=run, from_ns=int(tips.from_ns[row]), to_ns=int(tips.to_ns[row]))
        for run, row in zip(runs, fallen.tolist(), strict=True)
    )
    steep_deg = np.degrees(np.arctan(np.nanmedian(tips.fallen[fallen].max(axis=1))))
    return Located(
        phase="pre-slip",
        covariate="tilt",
        channel="rest",
        effect_size=len(fallen) / len(tips),
        p=p,
        tested="toppling",
        runs=tuple(sorted(runs))[:MOST_RUNS],
        windows=windows[:MOST_WINDOWS],
        summary=f"pre-slip: the block tips over an edge, at {steep_deg:.1f}° in the median, "
        f"in {len(fallen)} of {len(tips)} runs",
    )

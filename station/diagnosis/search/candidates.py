"""The candidates of a stage, from their scores: effects alone, pairs, smooth terms and places."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.inference.calibration import Calibration, calibrate
from station.diagnosis.inference.columns import Scores, Variant, at_sizes, scores
from station.diagnosis.inference.errors import UNIFORM
from station.diagnosis.inference.fit import Fit, fit, stepped
from station.diagnosis.inference.gain import estimate, gain, overdispersion, p_value
from station.diagnosis.inference.parameters import identifiable
from station.diagnosis.likelihood.noise import Noise
from station.diagnosis.likelihood.systematic import claimable
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.search.coinciding import Coinciding
from station.diagnosis.search.places import Place
from station.physics.effect import Effect, Values
from station.physics.model import Model, Term
from station.physics.parameter import Parameter
from station.physics.smooth import is_of_the_air, is_smooth

OFF_NULL = 0.1
"""The smallest size, in typical sizes, at which an effect with shapes starts: at its null a shape has no slope."""

PROMISED = 0.5
"""A fit that gains less than this share of what the scores promise has missed its maximum, and begins again from them.
"""

HARDLY = 0.003
"""The size, in typical sizes, from which a fit takes its first step: it is too small to fit worse than no effect."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """Effects (one or two) or a place, with their gain in twice the log likelihood, BIC, and uncorrected p.

    `twice_log_odds` are against nothing, the BIC with the prior. `against` is what the blocks' paths
    have against a law of sliding, see `by_paths`.
    """

    effects: tuple[Effect, ...]
    starts: tuple[Term, ...]
    place: Place | None
    twice_gain: float
    size: int
    p: float
    bic: float
    prior: float
    fitted: Fit | None = None
    against: float = 0.0

    @property
    def key(self) -> tuple[str, ...]:
        """The effects' ids in order, those of smooth terms among them."""
        return tuple(sorted(effect.id for effect in self.effects))

    @property
    def ids(self) -> tuple[str, ...]:
        """The effects' ids in order; `other` for a place or a smooth term."""
        if self.place is not None or self.smooth:
            return ("other",)
        return self.key

    @property
    def smooth(self) -> bool:
        """True if it has a smooth term."""
        return any(is_smooth(effect) for effect in self.effects)

    @property
    def unexpected(self) -> bool:
        """True for a smooth term, unless it is a straight line in the air's state, on which friction often depends."""
        return self.smooth and not all(is_of_the_air(effect) for effect in self.effects)

    @property
    def credible(self) -> bool:
        """True if its full fit is at a maximum with no size at a bound: such a law would want to leave its range.

        A law with shapes may be at a bound: a larger size and another shape are nearly the same there.
        """
        if self.fitted is None or not self.fitted.converged:
            return False
        known = {term.effect.id: term.values for term in self.fitted.model.terms}
        return all(_inside(effect, known[effect.id]) for effect in self.effects)

    @property
    def twice_log_odds(self) -> float:
        """Twice the log posterior odds against nothing."""
        return self.bic + 2.0 * math.log(self.prior / thresholds.NONE) - self.against


def candidates_of(scored: Scores, coinciding: Coinciding) -> tuple[list[Candidate], list[tuple[Variant, Variant]]]:
    """Returns each effect by its best variant, then all pairs of named effects; and the pairs' variants.

    Two laws of covariates that run together are no pair.
    """
    singles = _singles(scored)
    named = [variant for candidate, variant in singles if not candidate.smooth]
    couples = [
        (one, other)
        for one, other in itertools.combinations(named, 2)
        if not coinciding.repeats(one.effect, [other.effect.id])
    ]
    pairs = [_candidate(scored, pair, prior=thresholds.PAIR / len(couples)) for pair in couples]
    return [*(candidate for candidate, _ in singles), *pairs], couples


def single_candidates(evidence: Evidence, current: Fit, effects: Sequence[Effect]) -> list[Candidate]:
    """Returns the effects alone, by their scores around a fit."""
    return [candidate for candidate, _ in _singles(at_sizes(evidence, current, scores(evidence, current, effects)))]


def tested_alone(
    evidence: Evidence, current: Fit, effects: Sequence[Effect], rng: np.random.Generator
) -> tuple[list[Candidate], Calibration]:
    """Returns the candidates of `single_candidates`, and the session's own null that is drawn from the fit."""
    scored = at_sizes(evidence, current, scores(evidence, current, effects))
    calibration = calibrate(scored, [variant.columns for variant in scored.variants], rng)
    return [candidate for candidate, _ in _singles(scored)], calibration


def _singles(scored: Scores) -> list[tuple[Candidate, Variant]]:
    """Returns each effect alone by its best variant.

    The prior of its kind is shared evenly among the effects of that kind.
    """
    best: dict[str, tuple[Candidate, Variant]] = {}
    for variant in scored.variants:
        candidate = _candidate(scored, (variant,), prior=1.0)
        known = best.get(variant.effect.id)
        if known is None or candidate.twice_gain > known[0].twice_gain:
            best[variant.effect.id] = (candidate, variant)
    kinds = [candidate.unexpected for candidate, _ in best.values()]
    priors = {True: thresholds.OTHER / max(sum(kinds), 1), False: thresholds.SINGLE / max(len(kinds) - sum(kinds), 1)}
    return [
        (replace(candidate, prior=priors[unexpected]), variant)
        for (candidate, variant), unexpected in zip(best.values(), kinds, strict=True)
    ]


def _candidate(scored: Scores, variants: Sequence[Variant], *, prior: float) -> Candidate:
    columns = [column for variant in variants for column in variant.columns]
    twice, size, p = _gained(scored, columns, at_least=max(variant.twice_gain for variant in variants))
    effects = tuple(variant.effect for variant in variants)
    penalty = sum(variant.numbers for variant in variants) * math.log(max(scored.runs, 2))
    return Candidate(effects, _starts(scored, variants), None, twice, size, p, twice - penalty, prior)


def _gained(scored: Scores, columns: Sequence[int], *, at_least: float = 0.0) -> tuple[float, int, float]:
    """Returns twice the gain in log likelihood by the columns, or that known, their number, and the gain's p-value."""
    total, size = gain(scored, columns)
    twice = max(float(total[0]) / overdispersion(scored, columns), at_least)
    return twice, size, float(p_value(np.array(twice), size))


def _starts(scored: Scores, variants: Sequence[Variant]) -> tuple[Term, ...]:
    """Returns the terms where a full fit begins, at the sizes that the scores promise, or those that promise more."""
    sizes = iter(estimate(scored, [column for variant in variants for column in variant.columns]).tolist())
    starts = [_start(variant.start, sizes) for variant in variants]
    scored_alone = [float(gain(scored, variant.columns)[0][0]) for variant in variants]
    return tuple(
        variant.start if variant.twice_gain > alone else start
        for variant, start, alone in zip(variants, starts, scored_alone, strict=True)
    )


def _start(null: Term, sizes: Iterator[float]) -> Term:
    parameters = null.effect.parameters
    shaped = any(parameter.is_shape for parameter in parameters)
    values = dict(null.values)
    for parameter in parameters:
        if parameter.is_shape:
            continue
        size = next(sizes)
        if shaped and abs(size) < OFF_NULL:
            size = math.copysign(OFF_NULL, size)
        values[parameter.name] = parameter.clipped(parameter.neutral + size * parameter.typical)
    return Term(null.effect, values)


def place_candidate(scored: Scores, place: Place, *, of: int) -> Candidate:
    """Returns a place as a candidate that shares its prior with `of` places."""
    twice, size, p = _gained(scored, place.columns)
    return Candidate((), (), place, twice, size, p, twice - size * math.log(scored.runs), thresholds.OTHER / max(of, 1))


def _inside(effect: Effect, values: Values) -> bool:
    if any(parameter.is_shape for parameter in effect.parameters):
        return True
    return all(
        parameter.low < values[parameter.name] < parameter.high or values[parameter.name] == parameter.null
        for parameter in effect.parameters
    )


Asked = Callable[["Fitter", Fit], float]
Begins = Mapping[frozenset[str], tuple[Model, Noise]]
"""The models and noise from which fits begin, by the ids of their effects."""


class Fitter:
    """Fits models to one evidence, and keeps the likeliest fit of each set of effects.

    `begins` says where a first fit begins, if a search of nearly the same runs has found it already. `coinciding` has
    the covariates of laws that depend on one alone, and which of these run together.
    """

    def __init__(
        self, evidence: Evidence, begins: Begins | None = None, *, coinciding: Coinciding | None = None
    ) -> None:
        self.evidence, self._begins = evidence, begins or {}
        self.coinciding = coinciding or Coinciding()
        self._known: dict[frozenset[str], Fit] = {}
        self._begun_again = set[frozenset[str]]()
        self._asked: list[tuple[Fit, Asked, float]] = []

    def once(self, fitted: Fit, ask: Asked) -> float:
        """Returns the answer of `ask` about a fit; it is slow, so it is computed only once."""
        for known, asked, answer in self._asked:
            if known is fitted and asked is ask:
                return answer
        self._asked.append((fitted, ask, ask(self, fitted)))
        return self._asked[-1][2]

    def _fit(self, effects: Sequence[Effect], base: Fit, missing: Sequence[Term]) -> Fit:
        """Returns the known fit of these effects, or else a new one from `base` and the terms that it lacks."""
        key = key_of(effects)
        if key in self._known:
            return self._known[key]
        model, noise = self._begins[key] if key in self._begins else (self._begun(effects, base, missing), base.noise)
        return self.refit(model, effects, noise)

    def _begun(self, effects: Sequence[Effect], base: Fit, missing: Sequence[Term]) -> Model:
        """Returns the model one Newton step above `base`, with the missing terms' shapes where the scores say.

        Their sizes by the scores hold where all other numbers go along. Where these stayed, a series of the speed
        beside two laws of it began 1e8 nats down.
        """
        start, held = _with(base.model, map(_small, missing)), {term.effect.id for term in missing}
        return stepped(self.evidence, start, effects, noise=base.noise, held=held)

    def ends(self) -> Begins:
        """Returns models and noise at the end of all fits, from which fits of nearly the same runs may begin."""
        return {key: (found.model, found.noise) for key, found in self._known.items()}

    def fitted(self, current: Fit, candidate: Candidate) -> Candidate:
        """Returns the candidate after a full fit of the whole model together with it.

        The fit begins above the likeliest of the candidate's parts that were fitted. If it ends far below what the
        scores promise, it has missed its maximum and begins again where they say, once.
        """
        acting = claimable(current.model)
        effects = [*acting, *candidate.effects]
        parts = (self._known.get(key_of([*acting, effect])) for effect in candidate.effects)
        base = max([current, *(part for part in parts if part)], key=lambda part: part.log_likelihood)
        has = {term.effect.id for term in base.model.terms}
        missing = [start for start in candidate.starts if start.effect.id not in has]
        found = self._fit(effects, base, missing)
        short = 2 * (found.log_likelihood - current.log_likelihood) < PROMISED * candidate.twice_gain
        if short and key_of(effects) not in self._begun_again:
            self._begun_again.add(key_of(effects))
            found = self.refit(_with(current.model, candidate.starts), effects, current.noise)
        twice = 2 * (found.log_likelihood - current.log_likelihood)
        cost = sum(self._cost(found, effect, parameter) for effect, parameter in self._numbers(candidate))
        return replace(candidate, twice_gain=twice, bic=twice - cost, fitted=found)

    def _numbers(self, candidate: Candidate) -> list[tuple[Effect, Parameter]]:
        return [
            (effect, parameter) for effect in candidate.effects for parameter in identifiable(self.evidence, effect)
        ]

    def _cost(self, found: Fit, effect: Effect, parameter: Parameter) -> float:
        """Returns the cost of a number in twice the log likelihood: ln of the runs (BIC), or less for a shape.

        A shape costs no more than the share of its range that is ruled out: where the effect is weak nothing determines
        its shape, which explains nothing either. A shape at its bound costs little: a law that fits only at the end of
        its range is likely the simpler law that it becomes there. A number with a prior costs what the data say
        beyond it, by Laplace's approximation.
        """
        full = math.log(max(self.evidence.used(), 2))
        if parameter.sd:
            return max(2.0 * math.log(parameter.sd / found.sd(effect.id, parameter.name)), 0.0)
        if not parameter.is_shape:
            return full
        if found.at_bound(effect.id, parameter.name):
            return thresholds.LEAST_COST
        sd = found.sd(effect.id, parameter.name)
        spread = (parameter.high - parameter.low) / math.sqrt(UNIFORM)
        return min(full, max(2.0 * math.log(spread / sd), thresholds.LEAST_COST))

    def refit(self, start: Model, effects: Sequence[Effect], noise: Noise) -> Fit:
        """Fits these effects from `start`, and returns that fit or the likelier one that is known."""
        return self.likelier(fit(self.evidence, start, effects, noise=noise), effects)

    def likelier(self, found: Fit, effects: Sequence[Effect]) -> Fit:
        """Keeps a fit of these effects, and returns it or the likelier one that is known."""
        key = key_of(effects)
        known = self._known.get(key)
        if known is None or found.log_likelihood > known.log_likelihood:
            self._known[key] = found
        return self._known[key]


def key_of(effects: Iterable[Effect]) -> frozenset[str]:
    """Returns the ids by which `Begins` knows a fit of these effects."""
    return frozenset(effect.id for effect in effects)


def _with(model: Model, terms: Iterable[Term]) -> Model:
    for term in terms:
        model = model.with_term(term)
    return model


def _small(term: Term) -> Term:
    """Returns the term with its sizes almost at zero on the same side, and its shapes unchanged."""
    values = dict(term.values)
    for parameter in term.effect.parameters:
        if not parameter.is_shape:
            size = math.copysign(HARDLY * parameter.typical, values[parameter.name] - parameter.neutral)
            values[parameter.name] = parameter.clipped(parameter.neutral + size)
    return Term(term.effect, values)

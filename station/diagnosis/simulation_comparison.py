"""The diagnosis against a given simulation: numbers that both set differently, and effects that only one has.

Both are searched for effects by the same method. The simulation is judged with the recording's noise: a file without
scatter and camera noise shows differences that no recording could resolve. The effects of both are then fitted to both
and compared by their numbers: an effect is left out of the simulation where those must differ, not where it was found.

The difference d of k numbers has the covariance C = C_recording + C_simulation and gains d' C^-1 d of twice the log
likelihood over no difference (Wald 1943, Trans. Am. Math. Soc. 54, 426). It has to pay ln(runs) for each number, like
every term that the search adds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from station.diagnosis import thresholds
from station.diagnosis.inference.fit import Fit, fit
from station.diagnosis.inference.level import level_of, levelled
from station.diagnosis.inference.values import values_of
from station.diagnosis.likelihood.systematic import keeping
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.predict.folds import Fold
from station.diagnosis.result import Differs, Side, Value
from station.diagnosis.search.posterior import Posteriors, called, probability_of
from station.diagnosis.search.search import Search
from station.diagnosis.told_apart import change_of_smooth, determined_together, told_apart
from station.physics.contact import Array
from station.physics.effect import Effect
from station.physics.model import Model, Term


@dataclass(frozen=True, eq=False, kw_only=True)
class Found:
    """The evidence of one recording (the user's or the given simulation's) and what the search found in it.

    `folds` are the fits without each fold of the runs, as they were judged; a simulation has none. `friction` is the
    factor on a simulator's own friction with which its evidence was simulated.
    """

    evidence: Evidence
    search: Search
    posteriors: Posteriors
    folds: tuple[Fold, ...] = ()
    friction: float = 1.0


@dataclass(frozen=True, eq=False, kw_only=True)
class EffectComparison:
    """One effect, or the level of friction (`effect` None), in the recording and in the simulation.

    `gain` is in twice the log likelihood, `twice_log_odds` are those that the numbers differ; `side` says who has it.
    `reported` is what is said of the numbers that are told apart (`told_apart`).
    """

    effect: Effect | None
    side: Side
    numbers: tuple[Differs, ...]
    gain: float
    twice_log_odds: float
    reported: tuple[Differs, ...]

    @property
    def probability(self) -> float:
        """Posterior probability that the two differ."""
        return probability_of(self.twice_log_odds)


@dataclass(frozen=True, eq=False, kw_only=True)
class SimulationComparison:
    """All comparisons, with the level of friction apart.

    `differ_p` is the p-value of all differences together; `shared` is the fit to the recording of what the simulation
    has, with its numbers where these differ, and `given` the model that the recording is held against.
    `recording` and `simulation` are the fits of all effects to each of the two.
    """

    level: EffectComparison
    effects: tuple[EffectComparison, ...]
    differ_p: float
    shared: Fit
    given: Model
    recording: Fit
    simulation: Fit

    @property
    def differs(self) -> tuple[Differs, ...]:
        """The numbers that both have and set differently, the level's first."""
        both = (one for one in (self.level, *self.effects) if one.side == "both" and one.twice_log_odds > 0)
        return tuple(number for one in both for number in one.reported)


def as_noisy_as(recorded: Found, simulated: Evidence) -> Evidence:
    """Returns the simulation's evidence with the recording's noise as a lower bound for its rows and runs.

    A row of the simulation gets at least the median standard deviation of the recording's rows in the same channel.
    """
    noise = recorded.search.model.noise
    factor = dict[str, float]()
    for channel in simulated.channels:
        same = recorded.evidence.channel(channel.name)
        if same is not None:
            measured = noise.factor[channel.name] * float(np.median(same.rows.sigma))
            factor[channel.name] = measured / max(float(np.median(channel.rows.sigma)), 1e-12)
    return replace(simulated, floor=replace(noise, factor=factor))


def compared_with_simulation(recorded: Found, simulated: Found) -> SimulationComparison:
    """Fits the effects of both to both, and compares their numbers."""
    effects = _joint(recorded, simulated)
    fits = [_fitted(one, other, effects) for one, other in ((recorded, simulated), (simulated, recorded))]
    level = _level(recorded, simulated, fits)
    comparisons = tuple(_effect_compared(effect, recorded, simulated, fits) for effect in effects)
    gain = level.gain + sum(one.gain for one in comparisons)
    differ_p = float(chi2.sf(gain, 1 + sum(len(one.numbers) for one in comparisons)))
    return SimulationComparison(
        level=level,
        effects=comparisons,
        differ_p=differ_p,
        shared=_shared(recorded, fits, comparisons),
        given=_given(recorded, fits, comparisons),
        recording=fits[0],
        simulation=fits[1],
    )


def _shared(recorded: Found, fits: Sequence[Fit], comparisons: Sequence[EffectComparison]) -> Fit:
    """Fits what both have alike to the recording, beside what differs as the simulation has it.

    It begins as the plain model ended, with its noise. With that of the recording's own effects, the readings and the
    level would take up the difference itself, and the rest would seem to be more than chance.
    """
    alike = [one.effect for one in comparisons if one.effect is not None and one.twice_log_odds <= 0]
    start = _with_given(recorded.search.null.model, fits, comparisons)
    return fit(recorded.evidence, levelled(recorded.evidence, start), alike, noise=recorded.search.null.noise)


def _given(recorded: Found, fits: Sequence[Fit], comparisons: Sequence[EffectComparison]) -> Model:
    """Returns the simulation's law at the recorded level, with the readings as the recording's own effects leave them.

    What the recording differs by from it is the difference of the two, of which no reading takes up a part.
    """
    readings = keeping(fits[0].model, set())
    return levelled(recorded.evidence, _with_given(readings, fits, comparisons))


def _with_given(model: Model, fits: Sequence[Fit], comparisons: Sequence[EffectComparison]) -> Model:
    """Returns the model with what both have alike as the recording has it, and with the rest of the simulation."""
    for one in comparisons:
        if one.effect is not None and (one.twice_log_odds <= 0 or one.side != "recording"):
            terms = fits[0 if one.twice_log_odds <= 0 else 1].model.terms
            model = model.with_term(next(term for term in terms if term.effect.id == one.effect.id))
    return model


def _joint(recorded: Found, simulated: Found) -> list[Effect]:
    """Returns the effects of both; where two cannot be told from each other, only the recording's is kept."""
    mine = list(recorded.search.found)
    known = {name for classes in recorded.posteriors.classes.values() for name in classes} | {one.id for one in mine}
    for effect in simulated.search.found:
        alike = {called(effect.id), effect.id, *simulated.posteriors.classes.get(effect.id, ())}
        if not alike & known:
            mine.append(effect)
    return mine


def _fitted(one: Found, other: Found, effects: Sequence[Effect]) -> Fit:
    """Returns the fit of all effects to one of the two.

    One that it lacks has the other's shapes, and only its size is free.

    A shape means nothing where there is no size: were it free, a large size of a shape that acts nowhere would fit as
    well, and the size would be unknown. What one calls by another name of the same class makes room for the one that is
    compared.
    """
    model = keeping(one.search.model.model, {effect.id for effect in effects})
    acting = {term.effect.id for term in model.terms}
    there = {term.effect.id: term.values for term in other.search.model.model.terms}
    sized = {effect.id: effect if effect.id in acting else held(effect) for effect in effects}
    for effect in effects:
        if effect.id not in acting:
            shapes = {p.name: there.get(effect.id, {}).get(p.name, p.neutral) for p in effect.parameters if p.is_shape}
            model = model.with_term(Term(sized[effect.id], {**effect.neutral(), **shapes}))
    return fit(one.evidence, model, list(sized.values()), noise=one.search.model.noise)


def held(effect: Effect) -> Effect:
    """Returns the same law with its shapes as its term has them."""
    return effect.having(parameters=tuple(one for one in effect.parameters if not one.is_shape))


def _level(recorded: Found, simulated: Found, fits: Sequence[Fit]) -> EffectComparison:
    """Compares the coefficients of friction; their errors include the runs' scatter."""
    each = [_level_of(one, fitted) for one, fitted in zip((recorded, simulated), fits, strict=True)]
    number = Differs(name="mu_s", recording=each[0], simulation=each[1])
    gain = _gain((number,), sum((np.array([[value.sd**2]]) for value in each), np.zeros((1, 1))))
    odds = gain - _price(recorded, 1)
    return EffectComparison(
        effect=None, side="both", numbers=(number,), gain=gain, twice_log_odds=odds, reported=(number,)
    )


def _level_of(found: Found, fitted: Fit) -> Value:
    """Returns the level, as sure as the measurement can be trusted, however many runs there are."""
    level = level_of(found.evidence, fitted)
    sd = math.hypot(level.sd, thresholds.FRICTION_TRUSTED * level.value)
    return replace(level, value=level.value / found.friction, sd=sd / found.friction)


def _effect_compared(effect: Effect, recorded: Found, simulated: Found, fits: Sequence[Fit]) -> EffectComparison:
    """Compares one effect's numbers; its shapes count only where both were found to have the effect."""
    terms = [next(term for term in fitted.model.terms if term.effect.id == effect.id) for fitted in fits]
    each = zip((recorded, simulated), fits, terms, strict=True)
    has = [_has(found, effect, fitted, term) for found, fitted, term in each]
    numbers, covariance = _numbers(effect, fits, terms)
    gain = _gain(numbers, covariance)
    odds = gain - _price(recorded, len(numbers))
    side: Side = "both" if all(has) or odds <= 0 else "recording" if has[0] else "simulation"
    together = determined_together(recorded.evidence, fits, terms)
    reported = change_of_smooth(recorded.evidence, fits, terms) or told_apart(
        numbers, together, price=_price(recorded, 1)
    )
    return EffectComparison(
        effect=effect, side=side, numbers=numbers, gain=gain, twice_log_odds=odds, reported=reported
    )


def _numbers(effect: Effect, fits: Sequence[Fit], terms: Sequence[Term]) -> tuple[tuple[Differs, ...], Array]:
    """Returns the k numbers of an effect that are free in both, and the covariance (k, k) of their differences."""
    known = [
        (tuple(one.name for one in free), covariance)
        for free, covariance in (fitted.of_effect(effect.id) for fitted in fits)
    ]
    names = [name for name in known[0][0] if name in known[1][0]]
    each = [values_of(fitted, term) for fitted, term in zip(fits, terms, strict=True)]
    indices = [[there.index(name) for name in names] for there, _ in known]
    parts = [covariance[np.ix_(kept, kept)] for (_, covariance), kept in zip(known, indices, strict=True)]
    numbers = (Differs(name=f"{effect.id}.{name}", recording=each[0][name], simulation=each[1][name]) for name in names)
    return tuple(numbers), parts[0] + parts[1]


def _has(found: Found, effect: Effect, fitted: Fit, term: Term) -> bool:
    """Returns true if an effect was found in one of the two, by this name or by one that cannot be told from it there.

    By another name it counts if its sizes, which are fitted in that one's place, have to differ from none.
    """
    if effect.id in {one.id for one in found.search.found}:
        return True
    if not any(effect.id in found.posteriors.classes.get(one.id, ()) for one in found.search.found):
        return False
    free, covariance = fitted.of_effect(effect.id)
    sizes = [index for index, one in enumerate(free) if not one.is_shape]
    away = np.array([term.values[free[index].name] - free[index].neutral for index in sizes])
    return _of_difference(away, covariance[np.ix_(sizes, sizes)]) > _price(found, len(sizes))


def _gain(numbers: Sequence[Differs], covariance: Array) -> float:
    """Returns twice the log likelihood gained if k numbers may differ.

    `covariance` (k, k) is that of their differences.
    """
    return _of_difference(np.array([one.recording.value - one.simulation.value for one in numbers]), covariance)


def _of_difference(apart: Array, covariance: Array) -> float:
    """Returns the gain in twice the log likelihood of a difference (k,) from none, with its covariance (k, k)."""
    return float(apart @ np.linalg.pinv(covariance, hermitian=True) @ apart)


def _price(recorded: Found, count: int) -> float:
    """Returns the gain in twice the log likelihood that `count` numbers must exceed (BIC)."""
    return count * math.log(max(recorded.evidence.used(), 2))

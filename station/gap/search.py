"""The search: which effects, alone and in pairs, explain what the plain model does not, one stage after another.

Each stage looks at the residuals of the best model so far. Scores rank all effects that the recording can show, alone
and in pairs, and all smooth places; the session's own null, drawn from that model, says how large the largest gain
would be by chance. Only when it is larger are the best candidates fitted in full, and the likeliest joins the model.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from station.gap.evidence.evidence import Evidence
from station.gap.evidence.onsets import Onsets
from station.gap.statistics.calibration import Calibration, calibrate
from station.gap.statistics.columns import Scores, Variant, scores, variants_of
from station.gap.statistics.fit import Fit, fit
from station.gap.statistics.gain import gain, overdispersion, p_value
from station.gap.statistics.places import Place, places_of
from station.gap.statistics.systematic import without_nuisances
from station.physics.effect import Effect
from station.physics.model import Model, Term

ALARM = 0.04
"""At which global p the first stage looks for names; later ones are stricter, as each adds to what is claimed."""

NEXT = 0.005
MOST_STAGES = 4
FULL_FITS = 7
"""How many singles, and how many pairs, are fitted in full in each stage."""

CLASS_BIC = 6.0
"""Candidates within this of the best cannot be told from it."""

PAIR_BIC = 8.0
"""What a pair must gain beyond the best single: there are hundreds of pairs, and the next stage can add a second."""

LEAST_BIC, LEAST_OTHER_BIC = 6.0, 10.0
"""What a name, and a place without one, must gain to be claimed."""

OTHER_BIC = 4.0
"""What a smooth place must gain beyond the best name, as a name says more."""

MISFIT_SHARE, MISFIT_MOST = 0.1, 60.0
"""A further gain in the channels of an effect already found, below this share of its own, is its law's misfit;
beyond the second number it never is."""

Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Candidate:
    """Effects (one or two), or a place: what they gain in twice the log likelihood, their BIC, the uncorrected p."""

    effects: tuple[Effect, ...]
    place: Place | None
    twice_gain: float
    size: int
    p: float
    bic: float
    fitted: Fit | None = None

    @property
    def ids(self) -> tuple[str, ...]:
        """The effects' ids in order, or `other`."""
        return tuple(sorted(effect.id for effect in self.effects)) if self.place is None else ("other",)


@dataclass(frozen=True, eq=False)
class Stage:
    """One look at the residuals of `before`: corrected p, candidates by rank, places, and what was chosen."""

    before: Fit
    global_p: float
    calibration: Calibration
    candidates: tuple[Candidate, ...]
    places: tuple[Candidate, ...]
    chosen: Candidate | None
    alternatives: tuple[Candidate, ...]
    tried: int


@dataclass(frozen=True, eq=False)
class Search:
    """All stages. `model` is the last fit of named effects; `untestable` says why, by id."""

    null: Fit
    stages: tuple[Stage, ...]
    model: Fit
    other: tuple[Candidate, ...]
    untestable: Mapping[str, str]

    @property
    def global_p(self) -> float:
        """That anything is wrong with the plain model at all."""
        return self.stages[0].global_p

    @property
    def named(self) -> tuple[str, ...]:
        """Ids of the effects in the model."""
        return tuple(term.effect.id for term in without_nuisances(self.model.model).terms)


def search(
    evidence: Evidence, effects: Sequence[Effect], *, start: Model, rng: np.random.Generator, progress: Progress
) -> Search:
    """Runs all stages on evidence with at least one row of friction."""
    progress("fitting the plain model")
    null = fit(evidence, start, ())
    current, stages, other = null, list[Stage](), list[Candidate]()
    untestable = _untestable(evidence, null, effects)
    gained: list[tuple[frozenset[str], float]] = []
    for number in range(MOST_STAGES):
        progress(f"stage {number + 1}: scoring {len(effects)} effects, alone and in pairs")
        known = {term.effect.id for term in current.model.terms}
        rest = [effect for effect in effects if effect.id not in known and effect.id not in untestable]
        stage = _stage(evidence, current, rest, rng=rng, first=number == 0, gained=gained, progress=progress)
        stages.append(stage)
        if stage.chosen is None:
            break
        gained.append((_channels(evidence, stage.chosen), stage.chosen.twice_gain))
        if stage.chosen.fitted is None:
            other.append(stage.chosen)
            break
        current = stage.chosen.fitted
    return Search(null, tuple(stages), current, tuple(other), untestable)


def _stage(
    evidence: Evidence,
    current: Fit,
    effects: Sequence[Effect],
    *,
    rng: np.random.Generator,
    first: bool,
    gained: Sequence[tuple[frozenset[str], float]],
    progress: Progress,
) -> Stage:
    places, columns = places_of(evidence, _column_count(effects))
    scored = scores(evidence, current, effects, columns)
    singles = [_scored(scored, (variant,)) for variant in scored.variants]
    best = _best_variants(scored, singles)
    pairs = [_scored(scored, pair) for pair in itertools.combinations(best, 2)]
    spots = [_place(scored, place) for place in places]
    progress(f"drawing the session's null for {len(singles) + len(pairs) + len(spots)} candidates")
    sets = [variant.columns for variant in scored.variants] + [place.columns for place in places]
    sets += [(*one.columns, *two.columns) for one, two in itertools.combinations(best, 2)]
    calibration = calibrate(scored, sets, rng)
    smallest = min((candidate.p for candidate in [*singles, *pairs, *spots]), default=1.0)
    global_p = calibration.corrected(smallest)
    chosen, alternatives = None, tuple[Candidate, ...]()
    ranked = sorted([*_one_each(singles), *pairs], key=lambda candidate: -candidate.bic)
    if global_p < (ALARM if first else NEXT):
        progress("fitting the best candidates in full")
        chosen, alternatives, ranked = _judge(evidence, current, ranked, spots, gained)
    return Stage(
        before=current,
        global_p=global_p,
        calibration=calibration,
        candidates=tuple(ranked),
        places=tuple(sorted(spots, key=lambda spot: spot.p)),
        chosen=chosen,
        alternatives=alternatives,
        tried=len(singles) + len(pairs) + len(spots),
    )


def _column_count(effects: Sequence[Effect]) -> int:
    """How many columns the variants of effects have before those of the places."""
    return sum(not parameter.is_shape for effect, _ in variants_of(effects) for parameter in effect.parameters)


def _penalty(scored: Scores, effects: Sequence[Effect]) -> float:
    return sum(len(effect.parameters) for effect in effects) * math.log(max(scored.runs, 2))


def _scored(scored: Scores, variants: Sequence[Variant]) -> Candidate:
    columns = [column for variant in variants for column in variant.columns]
    total, size = gain(scored, columns)
    twice = float(total[0]) / overdispersion(scored, columns)
    effects = tuple(variant.effect for variant in variants)
    return Candidate(
        effects, None, twice, size, float(p_value(np.array(twice), size)), twice - _penalty(scored, effects)
    )


def _place(scored: Scores, place: Place) -> Candidate:
    total, size = gain(scored, place.columns)
    twice = float(total[0]) / overdispersion(scored, place.columns)
    return Candidate(
        (), place, twice, size, float(p_value(np.array(twice), size)), twice - size * math.log(scored.runs)
    )


def _best_variants(scored: Scores, singles: Sequence[Candidate]) -> list[Variant]:
    """Of each effect the variant that gains most."""
    best: dict[str, tuple[float, Variant]] = {}
    for variant, candidate in zip(scored.variants, singles, strict=True):
        known = best.get(variant.effect.id)
        if known is None or candidate.twice_gain > known[0]:
            best[variant.effect.id] = (candidate.twice_gain, variant)
    return [variant for _, variant in best.values()]


def _one_each(singles: Sequence[Candidate]) -> list[Candidate]:
    best: dict[tuple[str, ...], Candidate] = {}
    for candidate in singles:
        if candidate.ids not in best or candidate.twice_gain > best[candidate.ids].twice_gain:
            best[candidate.ids] = candidate
    return list(best.values())


def _judge(
    evidence: Evidence,
    current: Fit,
    ranked: Sequence[Candidate],
    spots: Sequence[Candidate],
    gained: Sequence[tuple[frozenset[str], float]],
) -> tuple[Candidate | None, tuple[Candidate, ...], list[Candidate]]:
    """Fits the best singles and pairs in full; the chosen one, what cannot be told from it, and the new ranking."""
    singles = [candidate for candidate in ranked if len(candidate.effects) == 1][:FULL_FITS]
    pairs = [candidate for candidate in ranked if len(candidate.effects) == 2][:FULL_FITS]
    fitted = [_fitted(evidence, current, candidate) for candidate in [*singles, *pairs] if candidate.twice_gain > 2]
    fitted = [candidate for candidate in fitted if candidate.fitted is not None and candidate.fitted.converged]
    fitted = [candidate for candidate in fitted if not _misfit(evidence, candidate, gained)]
    fitted.sort(key=lambda candidate: -candidate.bic)
    rest = [candidate for candidate in ranked if candidate.ids not in {one.ids for one in fitted}]
    best = _first(fitted)
    spot = max(spots, key=lambda candidate: candidate.bic, default=None)
    least = OTHER_BIC + best.bic if best else LEAST_OTHER_BIC
    if spot is not None and spot.bic > least and not _misfit(evidence, spot, gained):
        return spot, (), [*fitted, *rest]
    if best is None:
        return None, (), [*fitted, *rest]
    near = tuple(
        candidate
        for candidate in fitted
        if candidate is not best
        and candidate.bic > best.bic - CLASS_BIC
        and len(candidate.effects) == len(best.effects)
    )
    return best, near, [*fitted, *rest]


def _first(fitted: Sequence[Candidate]) -> Candidate | None:
    """The best single, unless a pair is better by more than the best of so many pairs is by chance."""
    singles = [candidate for candidate in fitted if len(candidate.effects) == 1 and candidate.bic > LEAST_BIC]
    pairs = [candidate for candidate in fitted if len(candidate.effects) == 2]
    if pairs and pairs[0].bic > PAIR_BIC + (singles[0].bic if singles else LEAST_BIC):
        return pairs[0]
    return singles[0] if singles else None


def _fitted(evidence: Evidence, current: Fit, candidate: Candidate) -> Candidate:
    """The candidate after a full fit of everything found so far together with it."""
    model = current.model
    for effect in candidate.effects:
        model = model.with_term(_start(effect, evidence, current))
    known = [term.effect for term in current.model.terms]
    found = fit(evidence, model, [*known, *candidate.effects], noise=current.noise)
    twice = 2 * (found.log_likelihood - current.log_likelihood)
    size = sum(len(effect.parameters) for effect in candidate.effects)
    bic = twice - size * math.log(max(evidence.used(), 2))
    return Candidate(candidate.effects, None, twice, candidate.size, candidate.p, bic, found)


def _start(effect: Effect, evidence: Evidence, current: Fit) -> Term:
    options = [start for known, start in variants_of([effect]) if known is effect]
    if len(options) == 1:
        return options[0]
    scored = scores(evidence, current, [effect])
    best = max(scored.variants, key=lambda variant: float(gain(scored, variant.columns)[0][0]))
    # Off its null: a shape has no slope at it.
    values = dict(best.start.values)
    for parameter in effect.parameters:
        if not parameter.is_shape:
            values[parameter.name] = parameter.clipped(parameter.neutral + 0.3 * parameter.typical)
    return Term(effect, values)


def _channels(evidence: Evidence, candidate: Candidate) -> frozenset[str]:
    if candidate.place is not None:
        return frozenset({candidate.place.channel.name})
    hooks = frozenset().union(*(effect.acts_through() for effect in candidate.effects))
    return frozenset(channel.name for channel in evidence.channels if channel.hooks & hooks)


def _misfit(evidence: Evidence, candidate: Candidate, gained: Sequence[tuple[frozenset[str], float]]) -> bool:
    channels = _channels(evidence, candidate)
    return any(
        channels & known and candidate.twice_gain < min(MISFIT_SHARE * size, MISFIT_MOST) for known, size in gained
    )


def _untestable(evidence: Evidence, null: Fit, effects: Sequence[Effect]) -> dict[str, str]:
    """Why effects cannot be seen in this recording, by id."""
    reasons: dict[str, str] = {}
    scored = scores(evidence, null, effects)
    onset = evidence.channel("onset")
    sensed = any(channel.name.startswith("sensor") for channel in evidence.channels)
    for effect in effects:
        columns = [column for variant in scored.variants if variant.effect is effect for column in variant.columns]
        hooks = effect.acts_through()
        if not any(channel.hooks & hooks for channel in evidence.channels):
            reasons[effect.id] = "this recording has nothing in which it would show"
            continue
        if effect.absorbed_by_mu and "attitude" in hooks and not sensed:
            reasons[effect.id] = f"without another angle sensor it is the same as another mu; {effect.separated_by}"
            continue
        why = effect.why_untestable(onset.moments.reported) if isinstance(onset, Onsets) else None
        if why and not (sensed and "attitude" in hooks):
            reasons[effect.id] = why
            continue
        reach = np.array([_reach(scored, column) for column in columns])
        if not np.any(np.diag(scored.information)[columns] * reach**2 > DETECTABLE**2):
            reasons[effect.id] = (
                f"too weak in this design: even its largest plausible size would not show; {effect.separated_by}"
            )
    return reasons


DETECTABLE = 2.8
"""Standard errors at which 80 of 100 are seen at a level of 5 %."""


def _reach(scored: Scores, column: int) -> float:
    """The farthest that a number may plausibly be from its null, in its typical sizes."""
    return float(min(max(abs(scored.low[column]), abs(scored.high[column])), 3.0))

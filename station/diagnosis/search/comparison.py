"""Each term of a model beside what could stand in its place, all other terms being as they are.

A stage chooses on the residuals of what was found before it. Once everything is found, each term is taken out again
and all that could fill its place is fitted anew: a better one takes it, and what is hardly worse cannot be told apart.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from station.diagnosis.inference.fit import Fit
from station.diagnosis.likelihood.systematic import is_nuisance, without_nuisances
from station.diagnosis.search.by_paths import against_nothing, gained, judged
from station.diagnosis.search.candidates import Candidate, Fitter, single_candidates
from station.diagnosis.search.misfit import Gained, is_trifle, superfluous
from station.physics.effect import Effect
from station.physics.model import Model
from station.physics.smooth import is_smooth

ROUNDS = 3
NAMED_FITS, SMOOTH_FITS = 8, 4
SWAP = 2.0
"""By how much a candidate must be likelier (twice the log odds) to take a term's place: ties stay as they are."""

SUBSTITUTE = 0.4
"""Of what either of two terms gains where the other is not there: if one beside the other gains less than this share,
it does the other's work, and makes up for the shape of its law."""

KNOWN_TO = 30.0
"""The gain (twice the log likelihood) at which the misfit of a law itself weighs as much as chance."""

CREDIBLE = 0.95
"""The posterior of what is not told apart."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """What could fill a place, fitted in full, the likeliest first; `without` is the model with the place empty.

    `against_nothing` is what the blocks' paths have against that, see `by_paths`.
    """

    without: Fit
    candidates: tuple[Candidate, ...]
    against_nothing: float = 0.0

    @property
    def needless(self) -> bool:
        """Whether nothing is likelier than anything."""
        return self.candidates[0].odds + self.against_nothing < 0

    @property
    def temperature(self) -> float:
        """By which differences are divided: nature is not exactly as any law says, and the more so the stronger it is.

        A likelihood that takes laws for exact would be ever surer of the least wrong one (Miller, Dunson 2019, JASA
        114, 1113: coarsened posteriors).
        """
        return 1.0 + max((candidate.twice_gain for candidate in self.candidates), default=0.0) / KNOWN_TO

    def shares(self) -> dict[str, float]:
        """Posterior by id, all smooth terms together as `other`, nothing as `none`; they add up to 1."""
        top = max((-self.against_nothing, *(candidate.odds for candidate in self.candidates)))
        temperature = self.temperature
        weights = {"none": math.exp(-0.5 * (top + self.against_nothing) / temperature)}
        for candidate in self.candidates:
            (name,) = candidate.ids
            # A smooth term has no law whose misfit could be excused.
            excused = 1.0 if candidate.smooth else temperature
            weight = math.exp(0.5 * (candidate.odds - top) / excused)
            weights[name] = weights.get(name, 0.0) + weight
        total = sum(weights.values())
        return {name: weight / total for name, weight in weights.items()}

    def class_of(self, name: str) -> tuple[str, ...]:
        """The name, and the likeliest others, until together they are credible."""
        shares = self.shares()
        chosen, total = [name], shares.get(name, 0.0)
        for other, share in sorted(shares.items(), key=lambda pair: -pair[1]):
            if total >= CREDIBLE * (1.0 - shares["none"]):
                break
            if other not in (name, "none"):
                chosen.append(other)
                total += share
        return tuple(chosen)


def revised(fitter: Fitter, current: Fit, offered: Sequence[Effect]) -> tuple[Fit, dict[str, Comparison]]:
    """The model with each term the best for its place, and the comparisons by the ids of its terms."""
    compared = dict[str, Comparison]()
    for _ in range(ROUNDS):
        current, compared, changed = _round(fitter, current, offered)
        if not changed:
            break
    kept = {effect.id for effect in _terms(current.model)}
    return current, {name: comparison for name, comparison in compared.items() if name in kept}


def _round(fitter: Fitter, current: Fit, offered: Sequence[Effect]) -> tuple[Fit, dict[str, Comparison], bool]:
    """Every term compared once; a better one takes its place, and one that is not needed leaves."""
    compared, gains, changed = dict[str, Comparison](), dict[str, Gained](), False
    for effect in _terms(current.model):
        comparison = _comparison(fitter, current, effect, offered)
        best = comparison.candidates[0]
        mine = next((one for one in comparison.candidates if one.effects[0].id == effect.id), None)
        if comparison.needless or is_trifle(fitter.evidence, comparison.without, current):
            current, changed = comparison.without, True
            continue
        if best is not mine and best.fitted and (mine is None or best.odds > mine.odds + SWAP):
            current, changed, mine = best.fitted, True, best
        if mine is not None:
            compared[mine.effects[0].id] = comparison
            gains[mine.effects[0].id] = gained(fitter, comparison.without, mine)
    name = superfluous(gains) or _substitute(fitter, current, gains)
    if name is not None:
        current, changed = compared[name].without, True
    return current, compared, changed


def _substitute(fitter: Fitter, current: Fit, gains: Mapping[str, Gained]) -> str | None:
    """Of two terms that do each other's work the one without a name, or the one that gains less.

    Beside each other both gain little, whatever they gain alone. Two named effects that look otherwise do each their
    own: how much one of them gains while the other is not there is a matter of what else is bent to stand in for that.
    """
    acting = [effect for effect in _terms(current.model) if effect.id in gains]
    for one in sorted(acting, key=lambda effect: (not is_smooth(effect), gains[effect.id].twice_gain)):
        for other in acting:
            if other == one or not gains[one.id].channels & gains[other.id].channels or not _alike(one, other):
                continue
            alone = _without(fitter, current, one), _without(fitter, current, other)
            neither = _without(fitter, alone[0], other)
            least = min(2 * (fit.log_likelihood - neither.log_likelihood) for fit in alone)
            if gains[one.id].twice_gain < SUBSTITUTE * least:
                return one.id
    return None


def _alike(one: Effect, other: Effect) -> bool:
    return is_smooth(one) or is_smooth(other) or one.family == other.family


def _terms(model: Model) -> list[Effect]:
    return [term.effect for term in without_nuisances(model).terms]


def _comparison(fitter: Fitter, current: Fit, effect: Effect, offered: Sequence[Effect]) -> Comparison:
    without = _less(fitter, current, effect)
    known = {term.effect.id for term in without.model.terms}
    ranked = single_candidates(fitter.evidence, without, [one for one in offered if one.id not in known])
    ranked.sort(key=lambda candidate: -candidate.odds)
    named = [one for one in ranked if not one.smooth and one.key != (effect.id,)][:NAMED_FITS]
    smooth = [one for one in ranked if one.smooth and one.key != (effect.id,)][:SMOOTH_FITS]
    own = [one for one in ranked if one.key == (effect.id,)]
    full = [fitter.fitted(without, one) for one in [*own, *named, *smooth]]
    good = judged(fitter, [one for one in full if one.credible or one.key == (effect.id,)])
    good.sort(key=lambda candidate: -candidate.odds)
    return Comparison(without, tuple(good), against_nothing(fitter, without, good[0]))


def _without(fitter: Fitter, current: Fit, effect: Effect) -> Fit:
    left, acting = _left(current, effect)
    return fitter.fit(left, acting, noise=current.noise)


def _less(fitter: Fitter, current: Fit, effect: Effect) -> Fit:
    """The fit without the effect, begun where the effect leaves it.

    One that ended short of its maximum before would leave the rest to whatever stands beside it, however small.
    """
    left, acting = _left(current, effect)
    return fitter.refit(left, acting, current.noise)


def _left(current: Fit, effect: Effect) -> tuple[Model, list[Effect]]:
    """A model without one of its effects, and those that are left in it."""
    terms = tuple(term for term in current.model.terms if term.effect.id != effect.id)
    acting = [term.effect for term in terms if not is_nuisance(term.effect)]
    return replace(current.model, terms=terms), acting

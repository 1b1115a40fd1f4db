"""Compares each term of a model with what could stand in its place, all other terms being present.

A stage chooses on the residuals of what was found before it. Once everything is found, each term is taken out again and
all that could fill its place is fitted anew: a better one replaces it, and what is hardly worse cannot be told from it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.inference.fit import Fit
from station.diagnosis.likelihood.systematic import claimable, less
from station.diagnosis.search.by_paths import with_path_evidence
from station.diagnosis.search.candidates import Candidate, Fitter, tested_alone
from station.diagnosis.search.excused import best_of_each, excused
from station.diagnosis.search.misfit import shares
from station.diagnosis.search.trifle import is_trifle
from station.physics.effect import Effect

ROUNDS = 3
NAMED_FITS, SMOOTH_FITS = 8, 4


@dataclass(frozen=True, eq=False)
class Comparison:
    """The candidates for one place, fitted in full, the likeliest first; `without` is the fit with the place empty.

    `by_chance` is the corrected p-value of the best score around `without`, by the session's own null.
    """

    without: Fit
    candidates: tuple[Candidate, ...]
    by_chance: float = 0.0

    @property
    def is_further(self) -> bool:
        """True if the model has other terms, and what is left without this one is within chance (p above NEXT)."""
        return bool(claimable(self.without.model)) and self.by_chance > thresholds.NEXT

    @property
    def needless(self) -> bool:
        """True if nothing is likelier than the best candidate."""
        return self.candidates[0].twice_log_odds < 0

    def shares(self) -> dict[str, float]:
        """Gives the posterior by id, with all smooth terms as `other` and nothing as `none`; the shares add up to 1."""
        none, *each = shares(self.candidates).tolist()
        by_id = {"none": none}
        for candidate, share in zip(self.candidates, each, strict=True):
            (name,) = candidate.ids
            by_id[name] = by_id.get(name, 0.0) + share
        return by_id

    def class_of(self, name: str) -> tuple[str, ...]:
        """Returns the name and the likeliest others, until together they reach the share CREDIBLE of all but `none`."""
        shares = self.shares()
        chosen, total = [name], shares.get(name, 0.0)
        for other, share in sorted(shares.items(), key=lambda pair: -pair[1]):
            if total >= thresholds.CREDIBLE * (1.0 - shares["none"]):
                break
            if other not in (name, "none"):
                chosen.append(other)
                total += share
        return tuple(chosen)


def revised(
    fitter: Fitter, current: Fit, offered: Sequence[Effect], rng: np.random.Generator
) -> tuple[Fit, dict[str, Comparison]]:
    """Returns the model with the best term in each place, and the comparisons by the ids of its terms."""
    compared = dict[str, Comparison]()
    for _ in range(ROUNDS):
        current, compared, changed = _round(fitter, current, offered, rng)
        if not changed:
            break
    kept = {effect.id for effect in claimable(current.model)}
    return current, {name: comparison for name, comparison in compared.items() if name in kept}


def _round(
    fitter: Fitter, current: Fit, offered: Sequence[Effect], rng: np.random.Generator
) -> tuple[Fit, dict[str, Comparison], bool]:
    """Compares every term once; a better candidate takes its place, and a term that is not needed is removed.

    A further name gets a stage of its own only if what is left is beyond chance; one that came as half of a pair has to
    pass the same test here.
    """
    compared, changed = dict[str, Comparison](), False
    for effect, without in weakest_first(fitter, current):
        left = _less(fitter, current, effect) if changed else without
        comparison = _comparison(fitter, left, effect, offered, rng)
        best = comparison.candidates[0]
        mine = next((one for one in comparison.candidates if one.effects[0].id == effect.id), None)
        if comparison.needless or comparison.is_further or is_trifle(fitter.evidence, comparison.without, current):
            current, changed = comparison.without, True
            continue
        if (
            best is not mine
            and best.fitted
            and (mine is None or best.twice_log_odds > mine.twice_log_odds + thresholds.SWAP)
        ):
            current, changed, mine = best.fitted, True, best
        if mine is not None:
            compared[mine.effects[0].id] = comparison
    return current, compared, changed


def weakest_first(fitter: Fitter, current: Fit) -> list[tuple[Effect, Fit]]:
    """Returns each term with the fit that is left without it, the likeliest of these fits first.

    Beside a term that is needless no other need be compared.
    """
    left = [(effect, _less(fitter, current, effect)) for effect in claimable(current.model)]
    return sorted(left, key=lambda one: -one[1].log_likelihood)


def _comparison(
    fitter: Fitter, without: Fit, effect: Effect, offered: Sequence[Effect], rng: np.random.Generator
) -> Comparison:
    known = {term.effect.id for term in without.model.terms}
    rest = [one for one in offered if one.id not in known and not fitter.coinciding.repeats(one, known)]
    ranked, null = tested_alone(fitter.evidence, without, rest, rng)
    by_chance = null.corrected(min(one.p for one in ranked))
    full = [fitter.fitted(without, one) for one in to_fit(fitter, ranked, effect)]
    good = with_path_evidence(fitter, [one for one in full if one.credible or one.key == (effect.id,)])
    good = excused(fitter, without, good)
    good.sort(key=lambda candidate: -candidate.twice_log_odds)
    return Comparison(without, tuple(good), by_chance)


def to_fit(fitter: Fitter, ranked: Sequence[Candidate], effect: Effect) -> list[Candidate]:
    """Returns an effect's own candidate, and the best others by their scores that promise anything."""
    ranked = sorted(ranked, key=lambda candidate: -candidate.twice_log_odds)
    own = [one for one in ranked if one.key == (effect.id,)]
    named = [one for one in ranked if not one.smooth and one not in own][:NAMED_FITS]
    smooth = [one for one in ranked if one.smooth and one not in own][:SMOOTH_FITS]
    twins = [one for one in best_of_each(fitter, ranked) if one not in own + named + smooth]
    return own + [one for one in named + smooth + twins if one.twice_gain > thresholds.PROMISING]


def _less(fitter: Fitter, current: Fit, effect: Effect) -> Fit:
    """Returns the fit without the effect, begun from the current values of the others.

    If it ended short of its maximum, the rest would be credited to whatever stands beside it.
    """
    left = less(current.model, effect.id)
    return fitter.refit(left, claimable(left), current.noise)

"""Outlook of a session: the search's own scores, priors and classes on sessions drawn from each rival.

The rows of a session that is done again have the slopes of every candidate. A session drawn from a rival has scores
whose mean is the rival's own signal and whose covariance is their information; from these follow the candidates' gains,
odds and shares as in the search, and so the class that the diagnosis would report.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.inference.columns import Looked, Scores, drawn_scores, looked, scores, scores_of
from station.diagnosis.inference.fit import Fit
from station.diagnosis.inference.gain import gain, smallest_p
from station.diagnosis.inference.parameters import free_numbers, vector_of
from station.diagnosis.inference.sparse import Sloped, sloped
from station.diagnosis.likelihood.noise import Noise
from station.diagnosis.likelihood.slopes import residuals
from station.diagnosis.likelihood.systematic import allowing_for, is_nuisance, without_nuisances
from station.diagnosis.next_experiment.own_noise import with_own_noise
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.search.misfit import temperature
from station.diagnosis.search.smooth import smooth_terms
from station.diagnosis.search.untestable import untestable_by
from station.physics.contact import Array, Bools
from station.physics.effect import Effect
from station.physics.model import Model, Term
from station.physics.smooth import is_smooth

DRAWS = 300
"""Sessions that are drawn for each name of a rival: a share of 0.8 of them is known to 0.02."""

OTHER = "other"


@dataclass(frozen=True, eq=False)
class Rival:
    """One of the explanations that are to be told apart: its effect with the values that it would have, its weight."""

    term: Term
    weight: float = 1.0

    @property
    def id(self) -> str:
        """The effect's id."""
        return self.term.effect.id


@dataclass(frozen=True, eq=False, kw_only=True)
class Question:
    """The rivals, the model of all else, and the noise; `ids` are the rivals' and perhaps `other`.

    An id has several rivals, at values that the recording leaves likely or at shapes that it left open. What the
    recorded paths said for or against a name belongs to that recording: a new session has paths of its own, which are
    not predicted.
    """

    rivals: tuple[Rival, ...]
    ids: tuple[str, ...]
    beside: Model
    noise: Noise
    effects: tuple[Effect, ...]
    """All effects of the catalogue, any of which may stand in a class."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Session:
    """A session with the scores of its candidates; `signals` are the columns of the rivals."""

    question: Question
    scored: Scores
    signals: Mapping[Rival, int]

    @cached_property
    def candidates(self) -> list[Columns]:
        """Every variant as a candidate, the rivals' own values among them."""
        return _candidates(self)

    @cached_property
    def alarm(self) -> float:
        """The p below which a search looks for names; it is the same for any number of runs."""
        null = drawn_scores(self.scored, np.random.default_rng(0), draws=DRAWS)
        return float(
            np.quantile(_smallest(self.candidates, _gains(self.scored, self.candidates, null)), thresholds.ALARM)
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class Trial:
    """A session in which one of the rivals is true."""

    session: Session
    truth: Rival

    @property
    def signal(self) -> int:
        """The column of the truth."""
        return self.session.signals[self.truth]


Look = Callable[[Question, Evidence], Session]
"""The scores that a session is judged by."""


def tried(question: Question, sessions: Sequence[Evidence], look: Look) -> list[Trial]:
    """Returns the trials of each rival with its session (rivals,).

    A session that several have in common is scored once.
    """
    scored = {evidence: look(question, evidence) for evidence in dict.fromkeys(sessions)}
    return [
        Trial(session=scored[evidence], truth=rival) for rival, evidence in zip(question.rivals, sessions, strict=True)
    ]


def all_candidates(question: Question, evidence: Evidence) -> Session:
    """Returns the scores of all candidates on a session, and the rivals' own signals beside them."""
    return _session(question, evidence, _nameable(question), smooth_terms(evidence))


def fewest_candidates(question: Question, evidence: Evidence) -> Session:
    """Returns the scores of the rivals alone, and of what a level of friction may absorb, with the rivals' signals.

    Fewer names are in the way, so it promises what all candidates do, or more, in a fraction of the time.
    """
    few = [one for one in _nameable(question) if one.id in question.ids or one.absorbed_by_mu]
    return _session(question, evidence, few, ())


def _nameable(question: Question) -> list[Effect]:
    return [one for one in question.effects if one.layer != "numerics" and one not in _acting(question.beside)]


def _session(question: Question, evidence: Evidence, named: Sequence[Effect], smooth: Sequence[Effect]) -> Session:
    seen = looked(evidence, question.beside, [*named, *smooth])
    null, reasons = _null(question, evidence, seen, named)
    # Effects of which a session shows nothing gain nothing in it, and so they may stand where it shows none at all.
    offered = [*(effect for effect in named if effect.id not in reasons), *smooth] or list(named)
    scored = scores_of(evidence, null, seen.of(offered), _signals(evidence, null, question.rivals))
    first = len(scored.score) - len(question.rivals)
    signals = {rival: first + index for index, rival in enumerate(question.rivals)}
    return Session(question=question, scored=scored, signals=signals)


def signal(question: Question, evidence: Evidence) -> Scores:
    """Returns the score of the first rival's signal, while all else of the model is free."""
    absorbed = [one for one in _nameable(question) if one.absorbed_by_mu]
    null, _ = _null(question, evidence, looked(evidence, question.beside, absorbed), absorbed)
    return scores(evidence, null, (), _signals(evidence, null, question.rivals[:1]))


def _null(
    question: Question, evidence: Evidence, seen: Looked, effects: Sequence[Effect]
) -> tuple[Fit, Mapping[str, str]]:
    """Returns the model beside the rivals as if it were fitted, and which effects the session cannot show, and why.

    `seen` are the slopes of these effects, and of others, around that model.
    """
    base = question.beside
    reasons = untestable_by(evidence, standing(evidence, base, question.noise), seen.of(effects), effects)
    absorbed = [effect for effect in effects if effect.absorbed_by_mu and effect.id in reasons]
    return standing(evidence, allowing_for(base, absorbed), question.noise), reasons


def _signals(evidence: Evidence, null: Fit, rivals: Sequence[Rival]) -> Sloped:
    """Returns the changes of the residuals (rows, rivals) by each rival."""
    at = residuals(evidence, null.model)
    changed = [residuals(evidence, null.model.with_term(one.term)) for one in rivals]
    parts = {name: np.column_stack([one[name] - values for one in changed]) for name, values in at.items()}
    return sloped(evidence, parts, len(rivals))


def standing(evidence: Evidence, model: Model, noise: Noise) -> Fit:
    """Returns a model as it is, as if it were the fit to the evidence: its own numbers stay free."""
    named = _acting(model)
    free = free_numbers(evidence, model, named)
    count = len(evidence.run_number)
    return Fit(
        model=model,
        free=free,
        vector=vector_of(model, free),
        covariance=np.zeros((len(free), len(free))),
        noise=noise,
        log_run=np.zeros(count),
        counted=evidence.counted,
        white=np.zeros(0),
        converged=True,
    )


def _acting(model: Model) -> list[Effect]:
    return [term.effect for term in without_nuisances(model).terms if not is_nuisance(term.effect)]


@dataclass(frozen=True, eq=False)
class Columns:
    """The columns of one candidate: the effect's id, the columns, how many sizes and shapes it has, its prior."""

    name: str
    columns: tuple[int, ...]
    sizes: int
    shapes: int
    prior: float
    smooth: bool = False


@dataclass(frozen=True, kw_only=True)
class Outlook:
    """The statistical power of a session to tell the rivals apart, and the expected log odds of the true one."""

    power: float
    log_odds: float


Groups = Sequence[Sequence[str]]
"""The rivals' ids (and perhaps `other`) in groups that are to be told from each other; within a group nothing is."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Drawn:
    """Sessions of a trial: whether a search would look for names in each (draws,), and the names' posterior."""

    truth: Rival
    looked: Bools
    posterior: _Posterior


def drawn(trials: Sequence[Trial], *, runs: float, rng: np.random.Generator) -> list[Drawn]:
    """Draws DRAWS sessions of each name, evenly from its trials, of so many runs with evidence."""
    trials_of = Counter(trial.truth.id for trial in trials)
    return [_drawn(trial, runs, rng, draws=-(-DRAWS // trials_of[trial.truth.id])) for trial in trials]


def _drawn(trial: Trial, runs: float, rng: np.random.Generator, *, draws: int) -> Drawn:
    session, candidates = trial.session, trial.session.candidates
    scored = session.scored.in_runs(runs)
    found = scored.information[:, trial.signal][:, None] + drawn_scores(scored, rng, draws=draws)
    gains = _gains(scored, candidates, found)
    looked = _smallest(candidates, gains) < session.alarm
    return Drawn(truth=trial.truth, looked=looked, posterior=_posterior(trial, scored, gains))


def outlook(sessions: Sequence[Drawn], groups: Groups) -> Outlook:
    """Returns the outlook of such sessions, averaged over their truths by the truths' weights."""
    total = sum(one.truth.weight for one in sessions)
    power, odds = 0.0, 0.0
    for one in sessions:
        share = one.truth.weight / total
        apart, ahead = _power_and_odds(one, groups)
        power, odds = power + share * apart, odds + share * ahead
    return Outlook(power=power, log_odds=odds)


def _power_and_odds(one: Drawn, groups: Groups) -> tuple[float, float]:
    """Returns the share of sessions that name the truth's group and no other, and its mean log odds over the others."""
    own = next(group for group in groups if one.truth.id in group)
    others = [name for group in groups if group is not own for name in group]
    tells, ahead = one.posterior.tells(own, others), one.posterior.ahead(own, others)
    return float(np.mean(one.looked & tells)), float(np.mean(ahead))


def _candidates(session: Session) -> list[Columns]:
    """Returns every variant as a candidate, the rivals' own values among them; priors as in the search."""
    variants = session.scored.variants
    named = {variant.effect.id for variant in variants if not is_smooth(variant.effect)}
    smooth = {variant.effect.id for variant in variants if is_smooth(variant.effect)}
    priors = {name: thresholds.SINGLE / len(named) for name in named}
    priors |= {name: thresholds.OTHER / len(smooth) for name in smooth}
    found = {
        one: Columns(
            one.effect.id,
            one.columns,
            sizes=len(one.columns),
            shapes=one.numbers - len(one.columns),
            prior=priors[one.effect.id],
            smooth=one.effect.id in smooth,
        )
        for one in variants
    }
    of = {one.name: one for one in found.values()}
    own = [replace(of[one.id], columns=(signal,)) for one, signal in session.signals.items() if one.id in named]
    return [*found.values(), *own]


def _gains(scored: Scores, candidates: Sequence[Columns], drawn: Array) -> list[Array]:
    """Returns twice the gain (draws,) of each candidate."""
    return [gain(scored, one.columns, drawn)[0] for one in candidates]


def _smallest(candidates: Sequence[Columns], gains: Sequence[Array]) -> Array:
    """Returns the smallest p (draws,) of all candidates."""
    return smallest_p((twice, len(one.columns)) for one, twice in zip(candidates, gains, strict=True))


def _posterior(trial: Trial, scored: Scores, gains: Sequence[Array]) -> _Posterior:
    """Returns the odds and shares of the candidates as the search would have them, from their gains in each draw."""
    session, cost = trial.session, math.log(max(scored.runs, 2.0))
    twice = with_own_noise(scored, trial.signal, [one.columns for one in session.candidates], gains)
    heat = np.array([temperature(column) for column in twice.T.tolist()])
    best: dict[str, tuple[bool, Array]] = {}
    for one, gained in zip(session.candidates, twice, strict=True):
        # A shape that nothing determines costs least; one that is known costs more, but then hardly matters.
        price = one.sizes * cost + one.shapes * thresholds.LEAST_COST
        odds = gained - price + 2.0 * math.log(one.prior / thresholds.NONE)
        before = best.get(one.name)
        best[one.name] = (one.smooth, odds if before is None else np.maximum(before[1], odds))
    names = [name for name, (smooth, _) in best.items() if not smooth]
    odds = np.array([*(best[name][1] for name in names), *_largest(best.values(), len(heat))])
    top = np.maximum(0.0, odds.max(axis=0))
    weights = [np.exp(0.5 * (best[name][1] - top) / heat) for name in names]
    # A smooth term has no law whose misspecification could be excused.
    unnamed = sum((np.exp(0.5 * (one - top)) for smooth, one in best.values() if smooth), np.zeros(len(heat)))
    shares = np.array([*weights, unnamed, np.exp(-0.5 * top / heat)])
    return _Posterior((*names, OTHER), shares / shares.sum(axis=0), odds, heat)


def _largest(all_odds: Iterable[tuple[bool, Array]], draws: int) -> Array:
    """Returns the largest odds (1, draws) of a smooth term."""
    unnamed = [odds for smooth, odds in all_odds if smooth]
    return np.max(unnamed, axis=0, keepdims=True) if unnamed else np.full((1, draws), -np.inf)


@dataclass(frozen=True, eq=False)
class _Posterior:
    """Odds (names, draws) of the named candidates and of `other`; shares (names + 1, draws) with `none` at the end."""

    names: tuple[str, ...]
    shares: Array
    odds: Array
    heat: Array

    def tells(self, group: Sequence[str], others: Sequence[str]) -> Bools:
        """Returns the draws (draws,) whose class has names of the group and none of the others."""
        inside = self._classes()
        mine, theirs = (np.array([name in names for name in self.names]) for names in (group, others))
        return np.asarray(inside[mine].any(axis=0) & ~inside[theirs].any(axis=0))

    def ahead(self, group: Sequence[str], others: Sequence[str]) -> Array:
        """Returns the log odds (draws,) of the likeliest of the group over the likeliest other, or over nothing."""
        best, rest = (np.maximum(0.0, self._largest(names)) for names in (group, others))
        return 0.5 * (best - rest) / self.heat

    def _largest(self, names: Sequence[str]) -> Array:
        chosen = [odds for name, odds in zip(self.names, self.odds, strict=True) if name in names]
        return np.max(chosen, axis=0) if chosen else np.zeros(self.odds.shape[1])

    def _classes(self) -> Bools:
        """Returns true (names, draws) where a name is in the class of the draw's likeliest one."""
        shares, none = self.shares[:-1], self.shares[-1]
        order = np.argsort(-shares, axis=0, kind="stable")
        before = np.cumsum(np.take_along_axis(shares, order, axis=0), axis=0)
        before = np.vstack([np.zeros((1, shares.shape[1])), before[:-1]])
        inside = before < thresholds.CREDIBLE * (1.0 - none)
        found = np.zeros(shares.shape, dtype=np.bool_)
        np.put_along_axis(found, order, inside, axis=0)
        found[:, self.odds.max(axis=0) <= 0.0] = False
        return found

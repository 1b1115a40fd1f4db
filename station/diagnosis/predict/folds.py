"""The folds of the runs, each predicted from the others: with the names of all runs, or with names found anew.

`named` refits the numbers only; the names have seen every run. `nested` searches anew without each fold, so that
nothing of a predicted run is known; it takes several times as long.

Runs with the same specimen and mount stay together where a session has enough such groups: what is learnt from one
block must hold for the next.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.inference.fit import Fit, fit
from station.diagnosis.likelihood import systematic
from station.diagnosis.likelihood.systematic import claimable
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.search.candidates import Begins, key_of
from station.diagnosis.search.search import Search, in_stages
from station.physics.contact import Array, Bools
from station.physics.effect import Effect
from station.physics.model import Model
from station.pool import spread

FOLDS = int(thresholds.FOLDS)


@dataclass(frozen=True, eq=False, kw_only=True)
class Fold:
    """The fits to all runs except those `left_out` (r,): the plain model, and the one that was found.

    `named` are the ids of the found model's effects, and `less` has by id the fit of the others alone. `anew` is True
    if the names were found without the runs that are left out.
    """

    left_out: Bools
    before: Fit
    after: Fit
    named: tuple[str, ...] = ()
    less: Mapping[str, Fit]
    anew: bool

    def of(self, evidence: Evidence) -> Evidence:
        """Returns the evidence that the fold was fitted to."""
        return evidence.without(self.left_out)


def assigned(evidence: Evidence, rng: np.random.Generator) -> Array:
    """Returns the number of each run's fold (r,): whole groups if there are enough of them, else runs at random.

    Groups that the table names stay together even if there are fewer of them than folds: two are enough.
    """
    if evidence.group is not None and np.ptp(evidence.group):
        group = np.unique(evidence.group, return_inverse=True)[1]
        return rng.permutation(np.arange(int(group.max()) + 1) % FOLDS)[group]
    facts = evidence.facts
    made = np.column_stack([facts.mount_rad, facts.mass_kg, facts.area_m2])
    _, group = np.unique(made, axis=0, return_inverse=True)
    count = int(group.max(initial=-1)) + 1
    if count < FOLDS:
        return rng.permutation(np.arange(evidence.runs) % FOLDS)
    return rng.permutation(np.arange(count) % FOLDS)[group.ravel()]


class Folding(Protocol):
    """Fits the plain and the found model without each fold (r,) of the runs; `jobs` is the number of processes."""

    def __call__(
        self, evidence: Evidence, effects: Sequence[Effect], whole: Search, *, fold: Array, seed: int, jobs: int
    ) -> tuple[Fold, ...]:
        """Returns one `Fold` for each number in `fold`."""
        ...


def named(
    evidence: Evidence, effects: Sequence[Effect], whole: Search, *, fold: Array, seed: int, jobs: int
) -> tuple[Fold, ...]:
    """Refits what all runs led to without each fold (r,); the arguments that only a search needs are ignored."""
    del effects, seed, jobs
    outs = [fold == number for number in np.unique(fold).tolist()]
    return tuple(_refitted(evidence.without(out), whole, anew=False) for out in outs)


def _refitted(part: Evidence, whole: Search, *, anew: bool) -> Fold:
    """Returns the model of all runs refitted to a part of them.

    `anew` is True if the part knows nothing of the others.
    """
    before = fit(part, whole.null.model, (), noise=None if anew else whole.null.noise)
    after = fit(part, whole.model.model, whole.found, noise=whole.model.noise) if whole.found else before
    names = tuple(effect.id for effect in whole.found)
    fold = Fold(left_out=~part.counted, before=before, after=after, named=names, less={}, anew=anew)
    return _with_less(part, fold, whole.fitter.ends())


def nested(
    evidence: Evidence, effects: Sequence[Effect], whole: Search, *, fold: Array, seed: int, jobs: int
) -> tuple[Fold, ...]:
    """Searches anew without each fold (r,), `jobs` of them at a time; it does not search where all runs show nothing.

    The noise is estimated anew as well: with the wander of all runs the held-out ones seem to be predicted better by
    .03 nat each (2 nulls of `python -m tests.concealed --tier null --seed 9`: .030 ± .025 and .033 ± .011).

    A fold's search has all stages. It lacks the last comparison of each term with what could stand in its place, which
    takes as long again and mostly determines how wide a class is.

    Args:
        evidence: the evidence of all runs.
        effects: the effects to consider.
        whole: the search of all runs; fits begin where its fits ended, and move to their own maximum.
        fold: (r,) number of each run's fold.
        seed: seeds the nulls' draws.
        jobs: the number of processes; with 1 no other process is started.
    """
    outs = [fold == number for number in np.unique(fold).tolist()]
    if not whole.found:
        return tuple(_refitted(evidence.without(out), whole, anew=True) for out in outs)
    begin = whole.null.model, whole.fitter.ends()
    work = partial(_searched, evidence, effects, begin, seed)
    with spread(work, enumerate(outs), jobs=min(jobs, FOLDS)) as found:
        return tuple(found)


def _searched(
    evidence: Evidence, effects: Sequence[Effect], begin: tuple[Model, Begins], seed: int, numbered: tuple[int, Bools]
) -> Fold:
    (number, left_out), (null, begins) = numbered, begin
    start, rng = Model(mu_s=null.mu_s), np.random.default_rng([seed, number])
    part = evidence.without(left_out)
    found = in_stages(part, effects, start=start, rng=rng, progress=lambda _: None, begins=begins)
    names = tuple(effect.id for effect in found.found)
    fold = Fold(
        left_out=left_out,
        before=found.null,
        after=found.model,
        named=names,
        less={},
        anew=True,
    )
    return _with_less(part, fold, begins)


def _with_less(part: Evidence, fold: Fold, begins: Begins) -> Fold:
    """Returns the fold with a fit without each of its names; without a single name that is the plain model."""
    if len(fold.named) == 1:
        return replace(fold, less={fold.named[0]: fold.before})
    return replace(fold, less={name: less(part, fold.after, name, begins) for name in fold.named})


def dropped(evidence: Evidence, fold: Fold, name: str) -> Fold:
    """Returns the fold without one of its names."""
    named = tuple(other for other in fold.named if other != name)
    return _with_less(fold.of(evidence), replace(fold, after=fold.less[name], named=named), {})


def less(evidence: Evidence, after: Fit, name: str, begins: Begins | None = None) -> Fit:
    """Returns the fit without one of its effects, begun where the others' fit to nearly the same runs has ended.

    If there is none in `begins`, it begins where the whole fit has them: without a term they may have far to go.
    """
    rest = systematic.less(after.model, name)
    others = claimable(rest)
    model, noise = (begins or {}).get(key_of(others), (rest, after.noise))
    return fit(evidence, model, others, noise=noise)


def refitted(evidence: Evidence, whole: Fit, effects: Sequence[Effect], fold: Array) -> tuple[tuple[Bools, Fit], ...]:
    """Returns for each fold its runs (r,) and the fit of given effects without them, begun from the whole fit.

    `fold` (r,) has the number of each run's fold.
    """
    outs = [fold == number for number in np.unique(fold)]
    return tuple((out, fit(evidence.without(out), whole.model, effects, noise=whole.noise)) for out in outs)

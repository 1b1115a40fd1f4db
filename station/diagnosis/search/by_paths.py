"""Of candidates that differ in the law of sliding alone: which of them the blocks' first paths speak against.

Where friction in the slides' windows leaves two laws about alike, how blocks gather speed decides (`evidence.paths`).
The paths are the windows' own data in part, and a fit of them ends a little short of its best: so they count little by
little, and never for more than tells neighbours apart.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

from station.diagnosis import thresholds
from station.diagnosis.inference.columns import variants_of
from station.diagnosis.inference.fit import Fit
from station.diagnosis.likelihood.systematic import is_nuisance, without_nuisances
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.paths import Paths
from station.diagnosis.search.candidates import Candidate, Fitter
from station.diagnosis.search.smooth import covariate_of
from station.physics.model import Term

FAMILY = "speed law"
Group = tuple[frozenset[str], int]
"""What candidates have besides their laws of sliding, and how many such laws."""


def judged(fitter: Fitter, candidates: Sequence[Candidate]) -> list[Candidate]:
    """The candidates, those that are fitted in full with what the paths have against them."""
    paths = fitter.evidence.paths
    if paths is None:
        return list(candidates)
    groups: dict[Group, list[Candidate]] = {}
    for candidate in candidates:
        group = _group(paths, candidate)
        if group is not None:
            groups.setdefault(group, []).append(candidate)
    against = dict[tuple[str, ...], float]()
    for members in groups.values():
        against |= _against(fitter, members)
    return [replace(candidate, against=against.get(candidate.key, 0.0)) for candidate in candidates]


def proposed(fitter: Fitter, current: Fit, ranked: Sequence[Candidate]) -> list[Candidate]:
    """The laws of sliding, alone and in pairs, that look like what all paths have in common: fitted from there.

    Two that nearly cancel each other in the slides' windows have no score by which they would be found.
    """
    paths = fitter.evidence.paths
    if paths is None or any(term.effect.family == FAMILY for term in without_nuisances(current.model).terms):
        return []
    laws = [one for one in ranked if one.effects and all(effect.family == FAMILY for effect in one.effects)]
    near = [(one, *paths.nearest(_starts(fitter.evidence, one))) for one in laws]
    most = max(thresholds.PATHS_NEAR * min((off for *_, off in near), default=0.0), thresholds.PATHS_NEAR_M_S2)
    chosen = [replace(one, starts=terms) for one, terms, off in near if off < most]
    for one in chosen:
        fitter.begin(current, one)
    return chosen


def _starts(evidence: Evidence, candidate: Candidate) -> list[tuple[Term, ...]]:
    """Each effect with each start of its shapes, a little of it, to either side."""
    each = [
        [sized for _, start in variants_of(evidence, [effect]) for sized in (_sized(start, 1.0), _sized(start, -1.0))]
        for effect in candidate.effects
    ]
    return list(itertools.product(*each))


def _sized(start: Term, sign: float) -> Term:
    sizes = {
        parameter.name: parameter.clipped(parameter.neutral + sign * parameter.typical)
        for parameter in start.effect.parameters
        if not parameter.is_shape
    }
    return start.with_values(**sizes)


def _group(paths: Paths, candidate: Candidate) -> Group | None:
    """None for what the paths do not tell: a smooth term but of the speed, or a model that shifts their clock.

    A smooth term of the speed begins at any level and goes on from there: it is what a drop and a second law are.
    """
    if candidate.fitted is None or candidate.fitted.model.acting("delay_s"):
        return None
    if candidate.smooth:
        return (frozenset(), 2) if [covariate_of(effect) for effect in candidate.effects] == ["speed"] else None
    told = {term.effect.id for term in paths.told(candidate.fitted.model)}
    laws = [effect.id for effect in candidate.effects if effect.id in told]
    return (frozenset(candidate.key) - set(laws), len(laws)) if laws else None


def _against(fitter: Fitter, members: Sequence[Candidate]) -> dict[tuple[str, ...], float]:
    """By key. What is so far behind that nothing against the others would bring it to the front is not looked at."""
    top = max(member.odds for member in members)
    near = {member.key: member for member in members if member.odds > top - 2 * thresholds.PATHS_MOST}
    if len(near) < 2:
        return dict.fromkeys(near, 0.0)
    twice = {key: _twice(fitter, member) for key, member in near.items()}
    best = max(twice.values())
    return {
        key: min(max(best - each - thresholds.PATHS_SLACK, 0.0) * thresholds.PATHS_SHARE, thresholds.PATHS_MOST)
        for key, each in twice.items()
    }


def _twice(fitter: Fitter, candidate: Candidate) -> float:
    assert candidate.fitted is not None
    return 2.0 * fitter.once(candidate.fitted, _of_paths)


def _of_paths(fitter: Fitter, fitted: Fit) -> float:
    paths = fitter.evidence.paths
    assert paths is not None
    return paths.log_likelihood([term for term in paths.told(fitted.model) if not is_nuisance(term.effect)])

"""Tests candidates that differ in their laws of sliding alone on the blocks' first paths.

Where the friction in the slides' windows fits two laws alike, the way blocks gather speed decides (`evidence.paths`).
The paths are in part the windows' own data, and a fit of them ends a little short of its maximum: only a share of their
evidence counts, and never more than tells neighbouring laws apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from station.diagnosis import thresholds
from station.diagnosis.inference.fit import Fit
from station.diagnosis.likelihood.systematic import is_nuisance
from station.diagnosis.observations.paths import Paths
from station.diagnosis.search.candidates import Candidate, Fitter
from station.diagnosis.search.smooth import covariate_of

Group = tuple[frozenset[str], int]
"""The ids of a candidate's effects besides its laws of sliding, and the number of those laws."""


def with_path_evidence(fitter: Fitter, candidates: Sequence[Candidate]) -> list[Candidate]:
    """Returns the candidates; those that are fitted in full carry what the paths have against them."""
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


def _group(paths: Paths, candidate: Candidate) -> Group | None:
    """Returns the candidate's group; None if the paths do not test it.

    They do not test a smooth term of anything but the speed, or a model that shifts their clock. A smooth term of the
    speed has any level at zero speed and any slope: it counts as a drop and a second law.
    """
    if candidate.fitted is None or candidate.fitted.model.acting("delay_s"):
        return None
    if candidate.smooth:
        return (frozenset(), 2) if [covariate_of(effect) for effect in candidate.effects] == ["speed"] else None
    sliding = {term.effect.id for term in paths.sliding_terms(candidate.fitted.model)}
    laws = [effect.id for effect in candidate.effects if effect.id in sliding]
    return (frozenset(candidate.key) - set(laws), len(laws)) if laws else None


def _against(fitter: Fitter, members: Sequence[Candidate]) -> dict[tuple[str, ...], float]:
    """Returns twice the log odds against each member by its key.

    A member that is too far behind to come to the front is not tested.
    """
    top = max(member.twice_log_odds for member in members)
    near = {member.key: member for member in members if member.twice_log_odds > top - 2 * thresholds.PATHS_MOST}
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
    return paths.log_likelihood([term for term in paths.sliding_terms(fitted.model) if not is_nuisance(term.effect)])

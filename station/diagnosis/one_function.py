"""Smooth terms of one covariate are one function of it, and one finding, however many of them the search needed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from station.diagnosis.inference.fit import Fit
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.result import EffectFound, Value, Verdict
from station.diagnosis.search.acting import acting
from station.diagnosis.search.smooth import covariate_of
from station.diagnosis.search.unnamed import change_of, smooth_in_words
from station.physics.model import Term
from station.physics.smooth import Smooth


@dataclass(frozen=True, eq=False)
class Finding:
    """A term of a fitted model, and what is said of it alone."""

    fitted: Fit
    term: Term
    effect: EffectFound


def as_one(evidence: Evidence, findings: Sequence[Finding]) -> list[EffectFound]:
    """Returns the effects, those with smooth terms of one covariate in one fit as one."""
    groups = dict[tuple[int, str], list[Finding]]()
    for number, one in enumerate(findings):
        smooth = isinstance(one.term.effect, Smooth)
        key = (id(one.fitted), covariate_of(one.term.effect)) if smooth else (number, "")
        groups.setdefault(key, []).append(one)
    return [_one(evidence, group) for group in groups.values()]


def _one(evidence: Evidence, group: Sequence[Finding]) -> EffectFound:
    """Returns the likeliest of the effects with the title, the size and the phases of their sum.

    A name that could stand for each of them stands for all.
    """
    first = max((one.effect for one in group), key=lambda effect: effect.probability)
    if len(group) == 1:
        return first
    fitted, terms = group[0].fitted, [one.term for one in group]
    near = tuple(name for name in first.class_ids if all(name in one.effect.class_ids for one in group))
    return replace(
        first,
        title=smooth_in_words(evidence, fitted.model, *terms),
        class_ids=near,
        verdict=_verdict(group, alone=len(near) == 1),
        parameters={name: value for one in group for name, value in _numbered(one, group)},
        determined=(change_of(evidence, fitted, terms),),
        other_by=first.other_by if len(near) > 1 else "",
        acting=acting(evidence, fitted, *(term.effect for term in terms)),
    )


def _verdict(group: Sequence[Finding], *, alone: bool) -> Verdict:
    if all(one.effect.verdict == "not supported" for one in group):
        return "not supported"
    return "supported" if alone else "indistinguishable"


def _numbered(one: Finding, group: Sequence[Finding]) -> list[tuple[str, Value]]:
    """Returns the numbers of one of the terms, whose names have the term's place in the group from the second on."""
    place = int(np.flatnonzero([each is one for each in group])[0]) + 1
    return [(name if place == 1 else f"{name}_{place}", value) for name, value in one.effect.parameters.items()]

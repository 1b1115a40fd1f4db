"""Excuses for laws: smooth functions of their covariate fit better, and so may laws of one that runs with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.inference.fit import Fit
from station.diagnosis.likelihood.systematic import without_nuisances
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.search.candidates import Candidate, Fitter
from station.physics.contact import Array
from station.physics.model import Model
from station.physics.smooth import is_smooth


def excused(fitter: Fitter, before: Fit, candidates: Sequence[Candidate]) -> list[Candidate]:
    """Gives the candidates, with laws as likely as the best smooth function of their covariate where they are excused.

    A law, or a straight line in the air's state, is excused if what it leaves of that function is less than a law's own
    misfit. Where covariates run together the best of each is; the others keep their distance from it.
    """
    best: dict[tuple[str, bool], Candidate] = {}
    for one in sorted(candidates, key=lambda candidate: candidate.twice_gain):
        best[_field(fitter, one), one.unexpected] = one
    return [_lifted(fitter, before, one, best) for one in candidates]


def best_of_each(fitter: Fitter, ranked: Sequence[Candidate]) -> list[Candidate]:
    """Returns the best law and the best smooth function of each covariate, by their scores."""
    best: dict[tuple[str, bool], Candidate] = {}
    for one in sorted(ranked, key=lambda candidate: candidate.twice_gain):
        if on := _field(fitter, one):
            best[on, one.unexpected] = one
    return list(best.values())


def is_misfit_of_law(fitter: Fitter, current: Fit, candidate: Candidate) -> bool:
    """Returns true for a smooth function of a covariate whose law is in the model, if it is small beside that law."""
    on = _field(fitter, candidate)
    if not on or not candidate.smooth or candidate.fitted is None:
        return False
    terms = without_nuisances(current.model).terms
    laws = [term for term in terms if fitter.coinciding.of.get(term.effect.id) == on and not is_smooth(term.effect)]
    kept = tuple(term for term in current.model.terms if term not in laws)
    does = between(fitter.evidence, replace(current.model, terms=kept), current.model)
    further = between(fitter.evidence, current.model, candidate.fitted.model)
    return bool(laws) and _is_inexact(further, does)


def _lifted(
    fitter: Fitter, before: Fit, one: Candidate, best: dict[tuple[str, bool], Candidate]
) -> Candidate:  # fmt: skip
    on = _field(fitter, one)
    smooth = best.get((on, True))
    if not on or one.unexpected or smooth is None or one.fitted is None or smooth.fitted is None:
        return one
    if on in fitter.coinciding.together:
        return replace(one, against=one.against - max(smooth.twice_gain - best[on, False].twice_gain, 0.0))
    whole = between(fitter.evidence, before.model, smooth.fitted.model)
    if _is_inexact(between(fitter.evidence, one.fitted.model, smooth.fitted.model), whole):
        return replace(one, against=one.against - max(smooth.twice_gain - one.twice_gain, 0.0))
    return one


def _field(fitter: Fitter, candidate: Candidate) -> str:
    """Returns the field that a candidate of one effect depends on alone; empty if there is none."""
    return fitter.coinciding.of.get(candidate.effects[0].id, "") if len(candidate.effects) == 1 else ""


def between(evidence: Evidence, one: Model, other: Model) -> Array:
    """Returns the difference (rows,) of two models' predicted friction, less the mean."""
    channels = [channel for channel in evidence.channels if channel.shares_friction]
    apart = np.concatenate([channel.residual(one) - channel.residual(other) for channel in channels])
    return apart - apart.mean()


def _is_inexact(rest: Array, whole: Array) -> bool:
    """Returns true if what a law leaves has a smaller share of the variance than its own misfit may have (KNOWN_TO)."""
    return float(rest @ rest) < float(whole @ whole) / thresholds.KNOWN_TO

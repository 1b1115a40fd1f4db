"""The answer from what was found: the names with their classes, sizes and verdicts, and the places."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.inference.determined import determined
from station.diagnosis.inference.fit import Fit
from station.diagnosis.inference.level import as_simulated, level_of
from station.diagnosis.inference.values import values_of
from station.diagnosis.likelihood.mapping import told
from station.diagnosis.likelihood.systematic import without_nuisances
from station.diagnosis.observations.downhill import off_downhill_rad
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.one_function import Finding, as_one
from station.diagnosis.result import Candidates, Diagnosis, EffectFound, FitQuality, HeldOutGain, Verdict
from station.diagnosis.search.acting import acting
from station.diagnosis.search.advised import advice
from station.diagnosis.search.beside import Beside
from station.diagnosis.search.kinds import kinds_of_runs
from station.diagnosis.search.locate import located, summary_of
from station.diagnosis.search.misfit import shares
from station.diagnosis.search.posterior import Posteriors, called
from station.diagnosis.search.search import Search, Stage
from station.diagnosis.search.toppled import shows_toppling, toppled
from station.diagnosis.search.unnamed import change, depends_on, smooth_in_words
from station.physics.catalogue import Catalogue
from station.physics.model import Model, Term, table_of_model
from station.physics.smooth import is_smooth
from station.signals.downhill import DOWNHILL_RAD

_ROWS = 10
"""The most candidates of a stage that the comparison table shows: the answer's size, nothing is decided by it."""


def why_not(evidence: Evidence) -> str | None:
    """Returns the reason, in one sentence, why nothing can be tested; None if something can."""
    used = evidence.used()
    if not evidence.channels or used == 0:
        left_out = (f"{count} {why}" for why, count in evidence.left_out.items())
        reasons = "; ".join(evidence.notes) or ", ".join(left_out) or "there is no run with a slide"
        return f"expected runs with an onset or a slide, found none: {reasons}"
    if used < thresholds.LEAST_RUNS:
        return (
            f"expected at least {thresholds.LEAST_RUNS:g} runs with an onset or a slide, found {used}: record more runs"
        )
    slid = _slid(evidence)
    if slid < thresholds.LEAST_SLID:
        return f"expected at least {thresholds.LEAST_SLID:g} runs in which the block slid, found {slid}: tilt further"
    off_rad = off_downhill_rad(evidence)
    if off_rad > DOWNHILL_RAD:
        return (
            f"expected blocks that slide down the plate, found most slides {math.degrees(off_rad):.0f}° off its "
            "steepest way down: the camera's picture of the plate, or the arm's attitude, has other axes than the plate"
        )
    return None


def _slid(evidence: Evidence) -> int:
    """Returns the number of runs in which the block slid; the other runs only bound friction from below."""
    rows = [channel.rows for channel in evidence.channels if channel.shares_friction]
    return len(np.unique(np.concatenate([one.run[~one.limit] for one in rows])))


@dataclass(frozen=True, eq=False)
class Assessment:
    """A search's posteriors, the gain of each name in unseen runs, and the model of these names with its quality."""

    posteriors: Posteriors
    gains: Mapping[str, HeldOutGain]
    model: Fit
    quality: FitQuality


def answered(
    evidence: Evidence,
    found: Search,
    assessment: Assessment,
    catalogue: Catalogue,
    *,
    name: str,
    rng: np.random.Generator,
) -> Diagnosis:
    """Returns the answer, with what is looked at beside the channels: where blocks toppled, and two kinds of runs."""
    posteriors, quality = assessment.posteriors, assessment.quality
    claimed = bool(found.found or found.places)
    effects = _effects(evidence, found, assessment)
    prior = thresholds.SINGLE / max(len(catalogue), 1)
    tips = toppled(evidence, tuple(catalogue.values()), prior=prior / (prior + thresholds.NONE), rng=rng)
    untestable = {name: why for name, why in found.untestable.items() if not shows_toppling(evidence, catalogue[name])}
    kinds = kinds_of_runs(evidence, found.model, rng)
    beside = [one for one in (tips, kinds) if one is not None]
    more = (effect for one in beside for effect in one.effects)
    effects = tuple(sorted((*effects, *more), key=lambda effect: -effect.probability))
    stages = found.stages
    return Diagnosis(
        recording=name,
        total_runs=evidence.total_runs,
        used_runs=evidence.used(),
        left_out=evidence.left_out,
        without_onset=evidence.without_onset,
        held_out_runs=evidence.used(),
        simulator="planar",
        mu_s=level_of(evidence, found.null),
        level="mu_k" if evidence.onsets is None else "mu_s",
        scatter=found.null.noise.scatter,
        # The smallest of several p-values counts once for each (Bonferroni).
        global_p=min([found.global_p, *((1 + len(beside)) * one.p for one in beside)]),
        verdict="supported" if beside else overall(effects, claimed=claimed),
        located=(*(place for one in beside for place in one.places), *located(evidence, found.stages)),
        effects=effects,
        other_probability=max(posteriors.other, 0.0 if kinds is None else 1.0 - kinds.none_probability),
        none_probability=posteriors.none * math.prod(one.none_probability for one in beside),
        fit=quality,
        candidates_tried=sum(stage.tried for stage in stages),
        candidates=tuple(row for number, stage in enumerate(stages) for row in _compared(number, stage)),
        untestable=untestable,
        numerics=(),
        notes=(*evidence.notes, *told(found.model.model), *(note for one in beside for note in one.notes)),
        model=table_of_model(_with_mass(as_simulated(evidence, assessment.model), catalogue, tips)),
    )


def _compared(number: int, stage: Stage) -> Iterator[Candidates]:
    """Yields the rows of a stage's comparison table; what is fitted in full has a share of the posterior."""
    fitted = [candidate for candidate in stage.candidates if candidate.fitted is not None]
    share = dict(zip((one.key for one in fitted), shares(fitted)[1:].tolist(), strict=True))
    for candidate in stage.candidates[:_ROWS]:
        yield Candidates(
            stage=number,
            ids=candidate.ids,
            label=" + ".join(candidate.key),
            twice_gain=float(candidate.twice_gain),
            parameters=sum(len(effect.parameters) for effect in candidate.effects),
            bic=float(candidate.bic),
            twice_log_odds=float(candidate.twice_log_odds),
            fitted=candidate.fitted is not None,
            share=share.get(candidate.key, 0.0),
        )


def _with_mass(model: Model, catalogue: Catalogue, tips: Beside | None) -> Model:
    for one in () if tips is None else tips.effects:
        model = model.with_term(Term(catalogue[one.id], {name: value.value for name, value in one.parameters.items()}))
    return model


def _effects(evidence: Evidence, found: Search, assessment: Assessment) -> tuple[EffectFound, ...]:
    """Returns the names that were found, also those that unseen runs do not confirm, and the places; by probability."""
    kept = {term.effect.id: (assessment.model, term) for term in without_nuisances(assessment.model.model).terms}
    every = {term.effect.id: (found.model, term) for term in without_nuisances(found.model.model).terms} | kept
    alone = (
        Finding(fitted, term, _effect(evidence, found, fitted, term, assessment)) for fitted, term in every.values()
    )
    listed = as_one(evidence, list(alone))
    for candidate, probability in zip(found.places, assessment.posteriors.places, strict=True):
        place = candidate.place
        where = "" if place is None else f": {summary_of(found.model.model, place)}"
        listed.append(
            EffectFound(
                id="other",
                title=f"something outside the catalogue{where}",
                class_ids=("other",),
                probability=probability,
                verdict="supported" if probability > thresholds.EVEN else "not supported",
                parameters={},
            )
        )
    return tuple(sorted(listed, key=lambda effect: -effect.probability))


def _effect(evidence: Evidence, found: Search, fitted: Fit, term: Term, assessment: Assessment) -> EffectFound:
    effect, posteriors, gain = term.effect, assessment.posteriors, assessment.gains[term.effect.id]
    near = posteriors.classes[effect.id]
    verdict: Verdict = "indistinguishable" if len(near) > 1 else "supported"
    changed = change(evidence, fitted, term)
    return EffectFound(
        id=called(effect.id),
        title=effect.title if not is_smooth(effect) else smooth_in_words(evidence, fitted.model, term),
        class_ids=near,
        probability=posteriors.effects[effect.id],
        verdict=verdict if gain.real and posteriors.effects[effect.id] > thresholds.EVEN else "not supported",
        parameters=values_of(fitted, term),
        determined=determined(evidence, fitted, term) if changed is None else (changed,),
        held_out_gain=gain,
        separated_by=advice(evidence, effect),
        other_by=_other_by(found, effect.id) if len(near) > 1 and "other" in near else "",
        acting=acting(evidence, fitted, effect),
        is_series=effect.is_series,
    )


def _other_by(found: Search, name: str) -> str:
    """Returns the quantity, in words, on which the likeliest smooth term in the place of a name depends."""
    unnamed = (one.effects[0] for one in found.compared[name].candidates if one.smooth)
    return next((depends_on(effect) for effect in unnamed), "")


def overall(effects: Sequence[EffectFound], *, claimed: bool) -> Verdict:
    """Returns the verdict on a recording: supported if any effect is, indistinguishable if all claims are classes."""
    verdicts = {effect.verdict for effect in effects} if claimed else set[Verdict]()
    if "supported" in verdicts:
        return "supported"
    return "indistinguishable" if "indistinguishable" in verdicts else "not supported"


def refusal(evidence: Evidence, catalogue: Catalogue, why: str, *, name: str) -> Diagnosis:
    """Returns the answer where nothing can be tested, and why."""
    return Diagnosis(
        recording=name,
        total_runs=evidence.total_runs,
        used_runs=evidence.used(),
        left_out=evidence.left_out,
        without_onset=evidence.without_onset,
        untestable=dict.fromkeys(catalogue, why),
        notes=(why, *(note for note in evidence.notes if note not in why)),
    )

"""The diagnosis of one recording from signals or samples: locate, name, model, fit, next experiment."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from shared.messages import Sample
from station.diagnosis import thresholds
from station.diagnosis.against import Found
from station.diagnosis.inference.determined import determined
from station.diagnosis.inference.fit import Fit, as_simulated
from station.diagnosis.inference.values import values_of
from station.diagnosis.likelihood.systematic import without_nuisances
from station.diagnosis.next_experiment.elsewhere import elsewhere
from station.diagnosis.next_experiment.plan import more_runs, next_experiment
from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.table import table_evidence
from station.diagnosis.predict.folds import Folding, assigned, less, named
from station.diagnosis.predict.quality import compared, sifted
from station.diagnosis.report.picture_data import PictureData, picture_data
from station.diagnosis.result import Candidates, Diagnosis, EffectFound, FitQuality, NextExperiment, Own, Value, Verdict
from station.diagnosis.search.advised import advice, tilts
from station.diagnosis.search.belief import Belief, beliefs, called
from station.diagnosis.search.locate import located, summary_of, told_of_smooth
from station.diagnosis.search.search import Progress, Search, in_stages, search, with_wander
from station.diagnosis.search.toppled import Toppled, shows_toppling, toppled
from station.physics.catalogue import Catalogue
from station.physics.model import Model, Term, table_of_model
from station.physics.smooth import is_smooth
from station.signals.measured import Measured
from station.signals.session import Signals

Recorded = Signals | Measured | Sequence[Sample]
"""A session's signals, the rows of a table, or samples alone."""


def evidence_from(recorded: Recorded, setting: Setting) -> Evidence:
    """The evidence of a session or a table."""
    return evidence_of(recorded, setting) if isinstance(recorded, Signals) else table_evidence(recorded, setting)


def diagnose(
    recorded: Recorded,
    catalogue: Catalogue,
    *,
    name: str = "",
    setting: Setting | None = None,
    mu_s: float = 0.4,
    seed: int = 1,
    progress: Progress = lambda _: None,
) -> Diagnosis:
    """Diagnoses a session's signals, or a table of samples by its onsets; the arguments are those of `examined`."""
    return examined(recorded, catalogue, name=name, setting=setting, mu_s=mu_s, seed=seed, progress=progress).diagnosis


@dataclass(frozen=True, kw_only=True)
class Examined:
    """A diagnosis, the data of its figures, and what was found in which evidence (None if nothing could be tested)."""

    diagnosis: Diagnosis
    pictures: PictureData
    found: Found | None = None


def examined(
    recorded: Recorded,
    catalogue: Catalogue,
    *,
    name: str = "",
    setting: Setting | None = None,
    mu_s: float = 0.4,
    seed: int = 1,
    folding: Folding = named,
    jobs: int = 1,
    progress: Progress = lambda _: None,
) -> Examined:
    """The diagnosis, with the data of the report's figures.

    Args:
        recorded: a session, or the rows of a table.
        catalogue: the effects to consider; `station.physics.catalogue.catalogue()` has them all.
        name: the recording's name in the result.
        setting: sizes of plate and block.
        mu_s: where the plain model's fit begins.
        seed: seeds the null's draws and the folds; the same seed gives the same answer.
        folding: how runs are held out: `folds.named`, or `folds.nested`, which searches anew in each fold.
        jobs: processes that search the folds in parallel; with 1 no other process is started.
        progress: is called with a message before each step.
    """
    progress("reading the evidence")
    chosen = setting or Setting()
    evidence = evidence_from(recorded, chosen)
    why = why_not(evidence)
    if why:
        return Examined(diagnosis=_refusal(evidence, catalogue, why, name=name), pictures=PictureData())
    rng = np.random.default_rng(seed)
    effects = tuple(catalogue.values())
    evidence = with_wander(evidence, Model(mu_s=mu_s))
    found = search(in_stages(evidence, effects, start=Model(mu_s=mu_s), rng=rng, progress=progress), progress)
    progress("predicting each fold of the runs by the others")
    folds = folding(evidence, effects, found, fold=assigned(evidence, rng), seed=seed, jobs=jobs)
    belief = beliefs(found)
    sift = sifted(evidence, folds, belief.classes)
    model = _kept(evidence, found, sift.own)
    quality = compared(evidence, sift, model)
    answer = _answer(evidence, found, _Judged(belief, sift.own, model, quality), catalogue, name=name, rng=rng)
    pictures = picture_data(evidence, found, (sift.before, sift.after), opening_radius_m=chosen.opening_radius_m)
    judged = Found(evidence=evidence, search=found, belief=belief, folds=sift.folds)
    return Examined(diagnosis=answer, pictures=pictures, found=judged)


def why_not(evidence: Evidence) -> str | None:
    """The reason, in one sentence, why nothing can be tested; None if something can."""
    used = evidence.used()
    if not evidence.channels or used == 0:
        reasons = "; ".join(evidence.notes) or "there is no run with a slide"
        return f"expected runs with an onset or a slide, found none: {reasons}"
    if used < thresholds.LEAST_RUNS:
        return (
            f"expected at least {thresholds.LEAST_RUNS:g} runs with an onset or a slide, found {used}: record more runs"
        )
    slid = _slid(evidence)
    if slid < thresholds.LEAST_SLID:
        return f"expected at least {thresholds.LEAST_SLID:g} runs in which the block slid, found {slid}: tilt further"
    return None


def _slid(evidence: Evidence) -> int:
    """The number of runs in which the block slid; the other runs only bound friction from below."""
    rows = [channel.rows for channel in evidence.channels if channel.shares_friction]
    return len(np.unique(np.concatenate([one.run[~one.limit] for one in rows])))


@dataclass(frozen=True, eq=False)
class _Judged:
    """The beliefs of a search, what each name adds for unseen runs, and the model of those names with its quality."""

    belief: Belief
    own: Mapping[str, Own]
    model: Fit
    quality: FitQuality


def _kept(evidence: Evidence, found: Search, own: Mapping[str, Own]) -> Fit:
    """The fit to all runs without the names that do not improve the prediction of unseen ones."""
    model = found.model
    for name, adds in own.items():
        if not adds.real:
            model = less(evidence, model, name)
    return model


def _answer(
    evidence: Evidence,
    found: Search,
    judged: _Judged,
    catalogue: Catalogue,
    *,
    name: str,
    rng: np.random.Generator,
) -> Diagnosis:
    belief, quality = judged.belief, judged.quality
    claimed = bool(found.found or found.places)
    effects = _effects(evidence, found, judged)
    further = _next(evidence, found, effects, catalogue)
    effects = tuple(_advised(effect, further) for effect in effects)
    prior = thresholds.SINGLE / max(len(catalogue), 1)
    tips = toppled(evidence, tuple(catalogue.values()), prior=prior / (prior + thresholds.NONE), rng=rng)
    untestable = {name: why for name, why in found.untestable.items() if not shows_toppling(evidence, catalogue[name])}
    verdict = overall(effects, claimed=claimed)
    if tips is not None:
        effects = tuple(sorted((*effects, *tips.effects), key=lambda effect: -effect.probability))
        verdict = "supported"
    stages = found.stages
    return Diagnosis(
        recording=name,
        total_runs=evidence.total_runs,
        used_runs=evidence.used(),
        held_out_runs=evidence.used(),
        simulator="planar",
        mu_s=_mu(evidence, found.null),
        scatter=found.null.noise.scatter,
        # The smaller of two p-values is doubled (Bonferroni).
        global_p=found.global_p if tips is None else min(found.global_p, 2.0 * min(found.global_p, tips.p)),
        verdict=verdict,
        located=(*(() if tips is None else (tips.place,)), *located(evidence, found.stages)),
        effects=effects,
        other_probability=belief.other,
        none_probability=belief.none * (1.0 if tips is None else tips.none_probability),
        fit=quality,
        next_experiment=further,
        candidates_tried=sum(stage.tried for stage in stages),
        candidates=tuple(
            Candidates(
                stage=number,
                ids=candidate.ids,
                told=" + ".join(candidate.key),
                twice_gain=float(candidate.twice_gain),
                parameters=sum(len(effect.parameters) for effect in candidate.effects),
                bic=float(candidate.bic),
                fitted=candidate.fitted is not None,
            )
            for number, stage in enumerate(stages)
            for candidate in stage.candidates[:10]
        ),
        untestable=untestable,
        numerics=(),
        notes=evidence.notes,
        model=table_of_model(_with_mass(as_simulated(evidence, judged.model), catalogue, tips)),
    )


def _next(
    evidence: Evidence, found: Search, effects: Sequence[EffectFound], catalogue: Catalogue
) -> NextExperiment | None:
    if tilts(evidence):
        return next_experiment(evidence, found, effects, catalogue)
    return elsewhere(evidence, effects, catalogue)


def _advised(effect: EffectFound, further: NextExperiment | None) -> EffectFound:
    """An effect with the plan that settles its class as the advice, in place of its law's own."""
    if further is None or not further.plan or not any(effect.id in group for group in further.separates):
        return effect
    return replace(effect, separated_by=further.why)


def _with_mass(model: Model, catalogue: Catalogue, tips: Toppled | None) -> Model:
    for one in () if tips is None else tips.effects:
        model = model.with_term(Term(catalogue[one.id], {name: value.value for name, value in one.parameters.items()}))
    return model


def _effects(evidence: Evidence, found: Search, judged: _Judged) -> tuple[EffectFound, ...]:
    """The names that were found, also those that unseen runs do not confirm, and the places; by probability."""
    kept = {term.effect.id: (judged.model, term) for term in without_nuisances(judged.model.model).terms}
    every = {term.effect.id: (found.model, term) for term in without_nuisances(found.model.model).terms} | kept
    listed = [_effect(evidence, fitted, term, judged) for fitted, term in every.values()]
    for candidate, believed in zip(found.places, judged.belief.places, strict=True):
        place = candidate.place
        where = "" if place is None else f": {summary_of(found.model, place)}"
        listed.append(
            EffectFound(
                id="other",
                title=f"something outside the catalogue{where}",
                class_ids=("other",),
                probability=believed,
                verdict="supported" if believed > thresholds.EVEN else "not supported",
                parameters={},
            )
        )
    return tuple(sorted(listed, key=lambda effect: -effect.probability))


def _effect(evidence: Evidence, fitted: Fit, term: Term, judged: _Judged) -> EffectFound:
    effect, belief, own = term.effect, judged.belief, judged.own[term.effect.id]
    near = belief.classes[effect.id]
    verdict: Verdict = "indistinguishable" if len(near) > 1 else "supported"
    return EffectFound(
        id=called(effect.id),
        title=effect.title if not is_smooth(effect) else told_of_smooth(evidence, fitted.model, term),
        class_ids=near,
        probability=belief.effects[effect.id],
        verdict=verdict if own.real and belief.effects[effect.id] > thresholds.EVEN else "not supported",
        parameters=values_of(fitted, term),
        determined=determined(evidence, fitted, term),
        own=own,
        separated_by=advice(evidence, effect),
    )


def overall(effects: Sequence[EffectFound], *, claimed: bool) -> Verdict:
    """The verdict on a recording: supported if any effect is, indistinguishable if all claims are classes."""
    if not claimed or all(effect.verdict == "not supported" for effect in effects):
        return "not supported"
    clear = [effect for effect in effects if effect.verdict == "supported"]
    return "supported" if clear else "indistinguishable"


def _mu(evidence: Evidence, null: Fit) -> Value:
    """The plain model's coefficient of friction, with the standard error that its runs' scatter leaves."""
    mu_s = as_simulated(evidence, null).mu_s
    return Value(value=mu_s, sd=mu_s * null.noise.scatter / math.sqrt(max(evidence.used(), 1)), unit="1")


def _refusal(evidence: Evidence, catalogue: Catalogue, why: str, *, name: str) -> Diagnosis:
    return Diagnosis(
        recording=name,
        total_runs=evidence.total_runs,
        used_runs=evidence.used(),
        held_out_runs=0,
        simulator="planar",
        mu_s=Value(value=math.nan, sd=math.nan, unit="1"),
        scatter=math.nan,
        global_p=1.0,
        verdict="untestable",
        located=(),
        effects=(),
        other_probability=0.0,
        none_probability=0.0,
        fit=FitQuality.unknown(),
        next_experiment=more_runs() if 0 < evidence.used() < 0.5 * evidence.total_runs else None,
        candidates_tried=0,
        candidates=(),
        untestable=dict.fromkeys(catalogue, why),
        numerics=(),
        notes=(why, *evidence.notes),
        model={},
    )

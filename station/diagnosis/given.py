"""The diagnosis against a simulation that the user gives: it is about the difference of the two."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.answer import overall
from station.diagnosis.diagnose import Examined, Recorded, evidence_from
from station.diagnosis.given_lacks import all_hold, lacks, least_level, refuse_too_few, refuse_without_slides
from station.diagnosis.inference.level import levelled
from station.diagnosis.inference.values import values_of
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.setting import Setting
from station.diagnosis.predict.simulated import parts_of_given, quality_of_given
from station.diagnosis.result import Diagnosis, EffectFound, NextExperiment
from station.diagnosis.search.acting import acting
from station.diagnosis.search.locate import located
from station.diagnosis.search.posterior import called, posteriors_of
from station.diagnosis.search.search import Progress, in_stages, looked_at, search
from station.diagnosis.search.unnamed import change, smooth_in_words
from station.diagnosis.simulation_comparison import (
    EffectComparison,
    Found,
    SimulationComparison,
    as_noisy_as,
    compared_with_simulation,
)
from station.physics.catalogue import Catalogue
from station.physics.effect import Effect
from station.physics.model import Model
from station.physics.smooth import is_smooth
from station.simulators.artefacts import CURES, said
from station.simulators.rerun import Part

Again = Callable[[float], Recorded]
"""The simulation again, with a factor on its own friction."""

SLIDES_SEEN = 0.5
"""A simulation is asked again if it shows less than this share of the recorded slides' windows."""
EARLIER = 3.0
"""It is then told as much less friction as is that many times the runs' scatter: nearly all its blocks slip before the
recorded ones do, and slide for as long. `tests/recovery/test_given_simulation.py` shows what is said otherwise."""
HALVED = 4
"""While all its blocks hold, a simulation is asked with half of that again, so many times at most: the steepest of dry
friction, 1.5 of rubber, is then below a tilt of 11°, and blocks that still hold do not obey the friction."""


@dataclass(frozen=True, kw_only=True)
class Given:
    """The diagnosis against a given simulation, and what a simulator that can be called is to be told in each fold.

    `mu_s` is the simulation's coefficient of friction.
    """

    diagnosis: Diagnosis
    parts: tuple[Part, ...] = ()
    mu_s: float = math.nan


def against_given(
    examined: Examined,
    simulated: Recorded,
    catalogue: Catalogue,
    *,
    setting: Setting,
    name: str,
    again: Again | None = None,
    camera: bool = True,
    gave: str = "",
    seed: int = 1,
    progress: Progress = lambda _: None,
) -> Given:
    """Returns the diagnosis with a simulation's recording of the same commands in place of the plain model.

    Args:
        examined: the diagnosis of the user's recording.
        simulated: the simulation's recording, or its table.
        catalogue: the effects to consider, as for the recording.
        setting: sizes of plate and block.
        name: the simulation's name in the result.
        again: simulates it with a factor on its friction, if it can be told of one.
        camera: False for a simulation that gives paths: no effect of a camera can be in it.
        gave: what the simulator gave for every run, in words, if that is why no block slides.
        seed: seeds the null's draws.
        progress: is called with a message before each step.

    Raises:
        UserError: if too few of the simulation's runs can be compared, or no block of them slides.
    """
    answer, recorded = examined.diagnosis, examined.found
    if recorded is None:
        return Given(diagnosis=answer)
    progress("reading the simulation")
    evidence = as_noisy_as(recorded, evidence_from(simulated, setting))
    refuse_too_few(recorded.evidence, evidence, simulated, name=name)
    as_it_is, friction = evidence, 1.0
    if again is not None and _slides(evidence) < SLIDES_SEEN * _slides(recorded.evidence):
        progress("simulating with less friction: the slides are seen too briefly")
        evidence, friction = _with_less_friction(recorded, evidence, again, setting, answer.mu_s.value)
    refuse_without_slides(answer, evidence, as_it_is=as_it_is, name=name, gave=gave)
    start, rng = Model(mu_s=answer.mu_s.value), np.random.default_rng(seed)
    staged = in_stages(
        evidence,
        tuple(effect for effect in catalogue.values() if camera or effect.layer != "camera"),
        start=start,
        rng=rng,
        progress=lambda stage: progress(f"simulation: {stage}"),
        numerics=True,
    )
    found = search(staged, rng, progress)
    theirs = Found(evidence=evidence, search=found, posteriors=posteriors_of(found), friction=friction)
    progress("comparing recording and simulation")
    compared = compared_with_simulation(recorded, theirs)
    # The rest of the recording is tested with all that the recording can show, also where the simulation cannot.
    left, _ = looked_at(recorded.evidence, compared.shared, recorded.search.offered, rng=rng, progress=progress)
    every = _compared(answer, compared, theirs)
    physical = _without_numerics(every, catalogue, clocks=camera)
    kept = _kept(every, compared)
    physics = tuple(effect for effect in kept if effect.layer != "numerics")  # settings are cured, not corrected
    least_p = min(max(compared.differ_p, thresholds.LEAST_P), left.global_p)  # the smaller of two p-values
    progress("predicting unseen runs by the simulation, and by what was found")
    diagnosis = replace(
        physical,
        fit=quality_of_given(recorded, theirs, compared, kept),
        simulator=name,
        given=True,
        notes=(*physical.notes, *lacks(recorded.evidence, evidence, simulated, name=name)),
        global_p=min(1.0, 2.0 * least_p),
        located=located(recorded.evidence, [left], against=compared.given),
        next_experiment=_still_asked(answer, physical),
        none_probability=0.0
        if physical.names
        else 1.0 - max((one.probability for one in physical.effects), default=0.0),
    )
    return Given(
        diagnosis=diagnosis,
        parts=parts_of_given(
            recorded, theirs, compared, physics, changed=bool(physical.names) or compared.level.twice_log_odds > 0
        ),
        mu_s=compared.level.numbers[0].simulation.value,
    )


def _slides(evidence: Evidence) -> int:
    """Returns the number of a recording's windows of slides."""
    return 0 if evidence.slides is None else len(evidence.slides)


def _with_less_friction(
    recorded: Found, simulated: Evidence, again: Again, setting: Setting, mu_s: float
) -> tuple[Evidence, float]:
    """Returns a simulation whose blocks slip before the recorded ones do, and the factor on its friction for that."""
    factor = _less_friction(recorded, simulated, Model(mu_s=mu_s))
    for _ in range(HALVED):
        simulated = as_noisy_as(recorded, evidence_from(again(factor), setting))
        if not all_hold(simulated):
            break
        factor *= 0.5
    return simulated, factor


def _less_friction(recorded: Found, simulated: Evidence, start: Model) -> float:
    """Returns the factor on a simulation's friction with which its blocks slip before the recorded ones do.

    One whose blocks all hold has at least the friction that held them.
    """
    own = least_level(simulated, start) if all_hold(simulated) else levelled(simulated, start).mu_s
    wanted = start.mu_s * math.exp(-EARLIER * recorded.search.model.noise.friction)
    return min(1.0, wanted / own)


def _still_asked(answer: Diagnosis, diagnosis: Diagnosis) -> NextExperiment | None:
    """Returns the recording's next experiment; None if all that it found is in the simulation as well."""
    left = any(effect.id in diagnosis.names and effect.side != "simulation" for effect in diagnosis.effects)
    return None if answer.names and not left else answer.next_experiment


def _without_numerics(diagnosis: Diagnosis, catalogue: Catalogue, *, clocks: bool) -> Diagnosis:
    """Returns the same with the artefacts of the simulation's solver apart: they are no physics, and have a cure.

    Without `clocks`, as where a function gives paths, what looks like one clock's offset is the solver's as well.
    """
    ours = {effect.id for effect in diagnosis.effects if _is_of_solver(effect, catalogue, clocks=clocks)}
    effects = tuple(effect for effect in diagnosis.effects if effect.id not in ours)
    rows = [
        said(one.id, one.parameters[size.name].value, size.unit, cured_by=CURES[one.id], before=None, after=None)
        for one in diagnosis.effects
        if one.id in ours and one.verdict != "not supported"
        for size in catalogue[one.id].parameters
        if not size.is_shape
    ]
    claimed = any(effect.verdict != "not supported" for effect in effects)
    return replace(diagnosis, effects=effects, verdict=overall(effects, claimed=claimed), numerics=tuple(rows))


def _is_of_solver(effect: EffectFound, catalogue: Catalogue, *, clocks: bool) -> bool:
    """Returns true if an effect can only be what the simulation's solver does."""
    if effect.id not in CURES:
        return False
    known = catalogue[effect.id]
    return known.layer == "numerics" or (known.family == "timing" and effect.side == "simulation" and not clocks)


def _kept(diagnosis: Diagnosis, compared: SimulationComparison) -> tuple[Effect, ...]:
    """Returns the effects that are claimed, and those that both have alike, whose part the others would take up."""
    claimed = {effect.id for effect in diagnosis.effects if effect.verdict != "not supported"}
    alike = {called(one.effect.id) for one in compared.effects if one.effect and one.side == "both"}
    effects = [one.effect for one in compared.effects if one.effect is not None]
    return tuple(effect for effect in effects if called(effect.id) in claimed | alike)


def _compared(answer: Diagnosis, compared: SimulationComparison, simulated: Found) -> Diagnosis:
    """Returns the recording's own answer with each effect compared, and the effects that only the simulation has."""
    comparisons = {called(one.effect.id): one for one in compared.effects if one.effect is not None}
    unseen = {called(name) for name in simulated.search.untestable}
    mine = [_of_recording(effect, comparisons.get(effect.id), unseen=effect.id in unseen) for effect in answer.effects]
    known = {effect.id for effect in mine}
    theirs = [_of_simulation(one, simulated) for key, one in comparisons.items() if key not in known]
    effects = tuple(sorted((*mine, *theirs), key=lambda effect: -effect.probability))
    claimed = any(effect.verdict != "not supported" for effect in effects)
    return replace(
        answer,
        effects=effects,
        differs=compared.differs,
        verdict=overall(effects, claimed=claimed),
    )


def _of_recording(effect: EffectFound, comparison: EffectComparison | None, *, unseen: bool) -> EffectFound:
    """Returns an effect of the recording; the simulation lacks it with the probability that their numbers differ.

    Of one that could not show in the simulation (`unseen`) nothing can be said.
    """
    if comparison is None:
        return effect
    if unseen and effect.verdict != "not supported":
        return replace(effect, verdict="untestable")
    probability = effect.probability * comparison.probability
    verdict = effect.verdict if probability > thresholds.EVEN else "not supported"
    return replace(effect, side=comparison.side, probability=probability, verdict=verdict)


def _of_simulation(comparison: EffectComparison, simulated: Found) -> EffectFound:
    """Returns an effect that was found in the simulation alone."""
    effect = comparison.effect
    assert effect is not None
    classes: Mapping[str, tuple[str, ...]] = simulated.posteriors.classes
    fitted = simulated.search.model
    near = classes.get(effect.id, (called(effect.id),))
    probability = simulated.posteriors.effects.get(effect.id, 0.0) * comparison.probability
    likely = "indistinguishable" if len(near) > 1 else "supported"
    term = next(term for term in fitted.model.terms if term.effect.id == effect.id)
    changed = change(simulated.evidence, fitted, term)
    return EffectFound(
        id=called(effect.id),
        title=smooth_in_words(simulated.evidence, fitted.model, term) if is_smooth(effect) else effect.title,
        class_ids=near,
        probability=probability,
        verdict=likely if probability > thresholds.EVEN else "not supported",
        parameters=values_of(fitted, term),
        determined=() if changed is None else (changed,),
        separated_by=effect.separated_by,
        side=comparison.side,
        acting=acting(simulated.evidence, fitted, effect),
        is_series=effect.is_series,
    )

"""The given simulation as a prediction of unseen runs, before and after what was found, and the models for a rerun."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from station.diagnosis.inference.fit import Fit, fit
from station.diagnosis.inference.level import as_simulated
from station.diagnosis.likelihood.systematic import claimable, keeping
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.predict.folds import Fold
from station.diagnosis.predict.quality import compared, of_folds, without_slides
from station.diagnosis.result import FitQuality
from station.diagnosis.simulation_comparison import Found, SimulationComparison
from station.physics.between import between
from station.physics.effect import Effect
from station.physics.model import Model
from station.simulators.rerun import Part
from station.simulators.simulator import AS_IT_IS


def quality_of_given(
    recorded: Found, simulated: Found, comparison: SimulationComparison, kept: Collection[Effect]
) -> FitQuality:
    """Returns the scores of the recording's unseen runs by the simulation's numbers, and by the recording's own.

    The simulation's friction and effects are taken as they were fitted to it, and the recording's noise and
    readings are fitted around them; `kept` are the effects that count as found in either. Of a simulation that shows no
    slide there are no errors of slides: how its blocks slide would be a guess.
    """
    given = model_of(simulated, comparison.simulation, kept)
    folds = [replace(fold, before=_as_given(fold.of(recorded.evidence), given, fold.before)) for fold in recorded.folds]
    found = compared(recorded.evidence, of_folds(recorded.evidence, folds), recorded.search.model)
    return found if simulated.evidence.slides is not None else replace(found, before=without_slides(found.before))


def parts_of_given(
    recorded: Found, simulated: Found, comparison: SimulationComparison, kept: Collection[Effect], *, changed: bool
) -> tuple[Part, ...]:
    """Returns the models that turn the simulator into one with the recording's friction, each fitted without its fold.

    If nothing was found to differ (`changed` is False), nothing is to be changed, and where the levels of friction were
    not, the simulation keeps its own: what lies between them is the runs' scatter.
    """
    runs = [_runs(recorded.evidence, fold) for fold in recorded.folds]
    if not changed:
        return tuple(Part(runs=own, before=AS_IT_IS, after=AS_IT_IS) for own in runs)
    given = model_of(simulated, comparison.simulation, kept)
    after = [between(_without_fold(recorded.evidence, fold, comparison, kept), given) for fold in recorded.folds]
    if comparison.level.twice_log_odds <= 0:
        level = _own_level(recorded, comparison, kept) / given.mu_s
        after = [replace(found, mu_s=level) for found in after]
    return tuple(Part(runs=own, before=AS_IT_IS, after=found) for own, found in zip(runs, after, strict=True))


def parts_of_plain(recorded: Found) -> tuple[Part, ...]:
    """Gives the plain model and the one that was found, for our own simulators, each fitted without its fold's runs."""
    parts = list[Part]()
    for fold in recorded.folds:
        evidence = fold.of(recorded.evidence)
        before = as_simulated(evidence, fold.before)
        after = before if fold.after is fold.before else as_simulated(evidence, fold.after)
        parts.append(Part(runs=_runs(recorded.evidence, fold), before=before, after=after))
    return tuple(parts)


def model_of(simulated: Found, fitted: Fit, kept: Collection[Effect]) -> Model:
    """Returns the simulation's model with these of its effects, as a simulator takes it."""
    left = keeping(fitted.model, {one.id for one in kept})
    model = as_simulated(simulated.evidence, replace(fitted, model=left))
    return replace(model, mu_s=model.mu_s / simulated.friction)


def _own_level(recorded: Found, comparison: SimulationComparison, kept: Collection[Effect]) -> float:
    """Returns the coefficient with which the recording's law has the simulation's level of friction."""
    (level,) = comparison.level.numbers
    found = as_simulated(recorded.evidence, _left(comparison, kept))
    return found.mu_s * level.simulation.value / level.recording.value


def _left(comparison: SimulationComparison, kept: Collection[Effect]) -> Fit:
    """Returns the recording's fit with these of its effects."""
    whole = comparison.recording
    return replace(whole, model=keeping(whole.model, {one.id for one in kept}))


def _without_fold(evidence: Evidence, fold: Fold, comparison: SimulationComparison, kept: Collection[Effect]) -> Model:
    part, left = fold.of(evidence), _left(comparison, kept)
    return as_simulated(part, fit(part, left.model, claimable(left.model), noise=left.noise))


def _as_given(evidence: Evidence, given: Model, plain: Fit) -> Fit:
    """Returns the simulation's model in the recording's evidence.

    Only the readings of onsets and places are fitted around it.

    The nuisances for what mu absorbs are left out: they would take up the very level that the simulation has wrong.
    """
    return fit(evidence, given, (), noise=plain.noise, level=False)


def _runs(evidence: Evidence, fold: Fold) -> frozenset[int]:
    return frozenset(evidence.run_number[fold.left_out].astype(int).tolist())

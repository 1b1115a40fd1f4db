"""A diagnosis with the next experiment that it calls for; it takes seconds, so only those who tell it ask for it."""

from __future__ import annotations

from dataclasses import replace

from station.diagnosis.diagnose import Examined
from station.diagnosis.next_experiment.air import in_other_air
from station.diagnosis.next_experiment.elsewhere import elsewhere
from station.diagnosis.next_experiment.plan import more_runs, next_experiment
from station.diagnosis.result import EffectFound, NextExperiment
from station.diagnosis.search.advised import tilts
from station.physics.catalogue import Catalogue


def recommended(examined: Examined, catalogue: Catalogue) -> Examined:
    """Returns the same diagnosis with its next experiment, which is also the advice on the effects that it separates.

    Args:
        examined: a diagnosis, with what was found in which evidence.
        catalogue: the effects that were considered.
    """
    further, answer = _further(examined, catalogue), examined.diagnosis
    effects = tuple(_advised(effect, further) for effect in answer.effects)
    return replace(examined, diagnosis=replace(answer, next_experiment=further, effects=effects))


def _further(examined: Examined, catalogue: Catalogue) -> NextExperiment | None:
    answer, found = examined.diagnosis, examined.found
    if found is None:
        return more_runs() if 0 < answer.used_runs < 0.5 * answer.total_runs else None
    if (other_air := in_other_air(found.search, answer.effects)) is not None:
        return other_air
    if tilts(found.evidence):
        return next_experiment(found.evidence, found.search, answer.effects, catalogue)
    return elsewhere(found.evidence, answer.effects, catalogue, answer.untestable)


def _advised(effect: EffectFound, further: NextExperiment | None) -> EffectFound:
    """Returns an effect with the plan that settles its class as the advice, in place of its law's own."""
    if further is None or not further.plan or not any(effect.id in group for group in further.separates):
        return effect
    return replace(effect, separated_by=further.why)

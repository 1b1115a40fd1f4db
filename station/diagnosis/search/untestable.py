"""The effects that a recording cannot show, whatever it contains, and the reasons."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.inference.columns import Looked, Scores, looked, scores_of
from station.diagnosis.inference.fit import Fit
from station.diagnosis.inference.noise_of import noise_of
from station.diagnosis.likelihood.noise import Noise
from station.diagnosis.observations.channel import ACTING, Channel
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.search.advised import advice
from station.diagnosis.search.places import Place, places_of
from station.physics.contact import Array
from station.physics.effect import Effect


def untestable(evidence: Evidence, null: Fit, effects: Sequence[Effect]) -> dict[str, str]:
    """Gives the reasons why effects cannot be seen in this recording, by id; effects that can be seen are not in it."""
    return untestable_by(evidence, null, looked(evidence, null.model, effects), effects)


def untestable_by(evidence: Evidence, null: Fit, seen: Looked, effects: Sequence[Effect]) -> dict[str, str]:
    """Returns the same from slopes of these effects that are known already."""
    scored = scores_of(evidence, replace(null, noise=noise_of_alike(evidence, null)), seen)
    reasons = {effect.id: _reason(evidence, scored, effect) for effect in effects}
    return {name: reason for name, reason in reasons.items() if reason}


def noise_of_alike(evidence: Evidence, null: Fit) -> Noise:
    """Returns the noise of runs that agree in all that is known of them, which an effect would have to stand out from.

    The plain model's own scatter holds whatever it leaves out: where friction falls to a half with the load, a change
    by a third with the run's number would seem too weak to show.
    """
    places, _ = places_of(evidence, 0)
    left = {channel.name: _left(channel, null, places) for channel in evidence.channels}
    return null.noise.at_most(noise_of(evidence, left))


def _left(channel: Channel, null: Fit, places: Sequence[Place]) -> Array:
    """Gives the residuals (n,) less a smooth function of each covariate, as large as they were before it was fitted."""
    residual, rows = channel.residual(null.model), channel.rows
    bases = [place.basis for place in places if place.channel is channel and channel.shares_friction]
    known = ~rows.limit
    if not bases or not known.any():
        return residual
    columns = np.column_stack([np.ones(len(rows)), *bases])
    numbers = np.linalg.matrix_rank(columns[known])
    free = len(np.unique(rows.run[known])) - numbers
    if free < numbers:  # needs twice as many runs as numbers: with fewer the rest says too little
        return residual
    fitted = columns @ np.linalg.lstsq(columns[known], residual[known], rcond=None)[0]
    return (residual - fitted) * math.sqrt(1.0 + numbers / free)


def _reason(evidence: Evidence, scored: Scores, effect: Effect) -> str | None:
    hooks, advised = effect.acts_through(), advice(evidence, effect)
    if not any(channel.hooks & hooks for channel in evidence.channels):
        return "this recording has nothing in which it would show"
    sensed = "attitude" in hooks and any(channel.hooks == ACTING["sensor"] for channel in evidence.channels)
    if effect.absorbed_by_mu and "attitude" in hooks and not sensed:
        return "; ".join(filter(None, ["without another angle sensor it is the same as another mu", advised]))
    contact = evidence.contact()
    why = effect.why_untestable(contact) if contact is not None else None
    if why and not sensed:
        return why
    columns = [column for variant in scored.variants if variant.effect is effect for column in variant.columns]
    reach = np.array([_reach(scored, column) for column in columns])
    if not np.any(np.diag(scored.information)[columns] * reach**2 > thresholds.DETECTABLE**2):
        weak = "too weak in this design: even its largest plausible size would not show"
        return "; ".join(filter(None, [weak, advised]))
    return None


def _reach(scored: Scores, column: int) -> float:
    """Returns the largest plausible distance of a number from its null, in its typical sizes."""
    return float(min(max(abs(scored.low[column]), abs(scored.high[column])), thresholds.PLAUSIBLE))

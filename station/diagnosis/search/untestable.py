"""The effects that a recording cannot show, whatever it contains, and the reasons."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.inference.columns import Scores, scores
from station.diagnosis.inference.fit import Fit
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.onsets import Onsets
from station.physics.effect import Effect


def untestable(evidence: Evidence, null: Fit, effects: Sequence[Effect]) -> dict[str, str]:
    """The reasons why effects cannot be seen in this recording, by id; effects that can be seen are not in it."""
    scored = scores(evidence, null, effects)
    reasons = {effect.id: _reason(evidence, scored, effect) for effect in effects}
    return {name: reason for name, reason in reasons.items() if reason}


def _reason(evidence: Evidence, scored: Scores, effect: Effect) -> str | None:
    hooks = effect.acts_through()
    if not any(channel.hooks & hooks for channel in evidence.channels):
        return "this recording has nothing in which it would show"
    sensed = "attitude" in hooks and any(channel.name.startswith("sensor") for channel in evidence.channels)
    if effect.absorbed_by_mu and "attitude" in hooks and not sensed:
        return f"without another angle sensor it is the same as another mu; {effect.separated_by}"
    onset = evidence.channel("onset")
    why = effect.why_untestable(onset.moments.reported) if isinstance(onset, Onsets) else None
    if why and not sensed:
        return why
    columns = [column for variant in scored.variants if variant.effect is effect for column in variant.columns]
    reach = np.array([_reach(scored, column) for column in columns])
    if not np.any(np.diag(scored.information)[columns] * reach**2 > thresholds.DETECTABLE**2):
        return f"too weak in this design: even its largest plausible size would not show; {effect.separated_by}"
    return None


def _reach(scored: Scores, column: int) -> float:
    """The largest plausible distance of a number from its null, in its typical sizes."""
    return float(min(max(abs(scored.low[column]), abs(scored.high[column])), thresholds.PLAUSIBLE))

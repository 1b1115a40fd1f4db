"""How much is believed of each name: weights of all that was compared, and what cannot be told from what."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from station.gap.search import OTHER_BIC, Candidate, Search, Stage

TEMPERATURE = 1.0
PAIR_SHARE = 0.2
"""Prior weight of all pairs together against all singles."""

OTHER_SHARE = 0.2


@dataclass(frozen=True, kw_only=True)
class Belief:
    """Probabilities of each named effect's class, of something other, of nothing; `classes` by the model's names."""

    effects: Mapping[str, float]
    classes: Mapping[str, tuple[str, ...]]
    other: float
    none: float


def beliefs(found: Search) -> Belief:
    """From the stages' comparisons."""
    effects, classes = dict[str, float](), dict[str, tuple[str, ...]]()
    other = 0.0
    for stage in found.stages:
        if stage.chosen is None:
            continue
        weights, spots, _ = _weights(stage)
        total = sum(weights.values()) + spots
        for effect in stage.chosen.effects:
            classes[effect.id] = _class(stage, effect.id)
            same = set(classes[effect.id])
            effects[effect.id] = sum(weight for ids, weight in weights.items() if same & set(ids)) / max(total, 1e-300)
        other = max(other, spots / max(total, 1e-300))
    none = _none(found.stages[0]) if found.stages else 1.0
    return Belief(effects=effects, classes=classes, other=other if found.other else min(other, 0.5), none=none)


def _weights(stage: Stage) -> tuple[dict[tuple[str, ...], float], float, float]:
    """Weights of the named candidates by ids, of all places together, and of nothing."""
    singles = [candidate for candidate in stage.candidates if len(candidate.effects) == 1]
    pairs = [candidate for candidate in stage.candidates if len(candidate.effects) == 2]
    top = max([0.0, *(candidate.bic for candidate in stage.candidates), *(spot.bic for spot in stage.places)])
    weights = {
        candidate.ids: _weight(candidate, top) * share / max(len(group), 1)
        for group, share in ((singles, 1.0), (pairs, PAIR_SHARE))
        for candidate in group
    }
    spots = sum(_weight(spot, top + OTHER_BIC) for spot in stage.places) * OTHER_SHARE / max(len(stage.places), 1)
    return weights, spots, math.exp(-0.5 * top / TEMPERATURE)


def _weight(candidate: Candidate, top: float) -> float:
    return math.exp(min(0.5 * float(candidate.bic - top) / TEMPERATURE, 0.0))


def _class(stage: Stage, effect_id: str) -> tuple[str, ...]:
    """The effect, and those that could stand in its place: alternatives with the rest of the chosen ones the same."""
    if stage.chosen is None:
        return (effect_id,)
    rest = set(stage.chosen.ids) - {effect_id}
    instead = [
        (set(candidate.ids) - rest, candidate.bic)
        for candidate in stage.alternatives
        if rest <= set(candidate.ids) and len(candidate.effects) == len(stage.chosen.effects)
    ]
    names = [next(iter(ids)) for ids, _ in sorted(instead, key=lambda pair: -pair[1]) if len(ids) == 1]
    return (effect_id, *dict.fromkeys(name for name in names if name != effect_id))


def _none(stage: Stage) -> float:
    weights, spots, nothing = _weights(stage)
    something = sum(weights.values()) + spots
    # The session's own calibration has the last word: at a global p of 1/2 nothing is likelier than anything.
    prior = np.clip(stage.global_p / 0.1, 1e-9, 1e3)
    return float(nothing * prior / max(nothing * prior + something, 1e-300))

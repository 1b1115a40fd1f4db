"""How much is believed of each name: weights of all that was compared, and what cannot be told from what."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.search.search import Search, Stage
from station.physics.smooth import PREFIX


@dataclass(frozen=True, kw_only=True)
class Belief:
    """Posterior of each term's class, of each place, of something other, of nothing; `classes` by the terms' ids."""

    effects: Mapping[str, float]
    places: Sequence[float]
    classes: Mapping[str, tuple[str, ...]]
    other: float
    none: float


def beliefs(found: Search) -> Belief:
    """From the comparisons of the model's terms with what could stand in their places."""
    shares = {name: comparison.shares() for name, comparison in found.compared.items()}
    classes = {name: comparison.class_of(called(name)) for name, comparison in found.compared.items()}
    effects = {name: sum(shares[name].get(member, 0.0) for member in members) for name, members in classes.items()}
    other = max((share.get("other", 0.0) for share in shares.values()), default=0.0)
    places = [_sure(place.odds) for place in found.places]
    other = max([other, *places])
    return Belief(effects=effects, classes=classes, places=places, other=other, none=_none(found.stages[0]))


def called(effect_id: str) -> str:
    """A term's name in results: its id, `other` for a smooth term."""
    return "other" if effect_id.startswith(PREFIX) else effect_id


def _sure(odds: float) -> float:
    return 1.0 / (1.0 + math.exp(-0.5 * min(odds, 700.0)))


def _none(stage: Stage) -> float:
    """That there is nothing: by the odds of all candidates against it, and by the session's own calibration.

    The calibration has the last word: at a global p of 1/2 nothing is likelier than anything.
    """
    odds = [candidate.odds for candidate in (*stage.candidates, *stage.places)]
    top = max([0.0, *odds])
    something = sum(math.exp(0.5 * (one - top)) for one in odds)
    nothing = math.exp(-0.5 * top) * float(np.clip(stage.global_p / thresholds.NOMINAL, 1e-9, 1e3))
    return nothing / max(nothing + something, 1e-300)

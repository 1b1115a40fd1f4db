"""The posterior probability of each name, from the odds of all candidates, and its class of equivalent names."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.search.search import Search, Stage
from station.physics.smooth import PREFIX


@dataclass(frozen=True, kw_only=True)
class Posteriors:
    """Posteriors of each term's class (by term id), of the places, of `other` and of `none`; `classes` by term id."""

    effects: Mapping[str, float]
    places: Sequence[float]
    classes: Mapping[str, tuple[str, ...]]
    other: float
    none: float


def posteriors_of(found: Search) -> Posteriors:
    """Returns the posteriors from the comparisons of the model's terms with what could stand in their places."""
    shares = {name: comparison.shares() for name, comparison in found.compared.items()}
    classes = {name: comparison.class_of(called(name)) for name, comparison in found.compared.items()}
    effects = {name: sum(shares[name].get(member, 0.0) for member in members) for name, members in classes.items()}
    other = max((share.get("other", 0.0) for share in shares.values()), default=0.0)
    places = [probability_of(place.twice_log_odds) for place in found.places]
    other = max([other, *places])
    return Posteriors(effects=effects, classes=classes, places=places, other=other, none=_none(found.stages[0]))


def called(effect_id: str) -> str:
    """Returns a term's name in results: its id, or `other` for a smooth term."""
    return "other" if effect_id.startswith(PREFIX) else effect_id


def probability_of(twice_log_odds: float) -> float:
    """Returns the probability that has these log odds, given as twice their value."""
    return 1.0 / (1.0 + math.exp(-0.5 * max(min(twice_log_odds, 700.0), -700.0)))


def _none(stage: Stage) -> float:
    """Gives the posterior probability that nothing is missing, from all candidates' odds and the session's calibration.

    The calibration multiplies the odds of nothing by the global p over NOMINAL.
    """
    odds = [candidate.twice_log_odds for candidate in (*stage.candidates, *stage.places)]
    top = max([0.0, *odds])
    something = sum(math.exp(0.5 * (one - top)) for one in odds)
    nothing = math.exp(-0.5 * top) * float(np.clip(stage.global_p / thresholds.NOMINAL, 1e-9, 1e3))
    return nothing / max(nothing + something, 1e-300)

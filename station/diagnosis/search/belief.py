"""How much is believed of each name: weights of all that was compared, and what cannot be told from what."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from station.diagnosis.search.candidates import Candidate
from station.diagnosis.search.comparison import Comparison
from station.diagnosis.search.search import Search, Stage
from station.physics.effect import Effect
from station.physics.smooth import PREFIX, is_smooth

DOUBT = 0.15
"""The share of a law's gain at which a smooth term beside it is as likely its misfit as physics of its own."""

DOUBT_OF_SERIES = 0.5
"""The same of anything that is found after the first terms of a series."""

NOMINAL = 0.1
"""The global p at which the session's own calibration speaks neither for nor against nothing."""


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
    effects = {
        name: _trust(found, name) * sum(shares[name].get(member, 0.0) for member in members)
        for name, members in classes.items()
    }
    other = max((share.get("other", 0.0) for share in shares.values()), default=0.0)
    places = [_sure(place.odds) * _trust_in_place(found, place) for place in found.places]
    other = max([other, *places])
    return Belief(effects=effects, classes=classes, places=places, other=other, none=_none(found.stages[0]))


def _trust(found: Search, name: str) -> float:
    """That a term is more than the misfit of a law beside it: by its gain's share of the largest of theirs.

    Named effects passed `misfit` by the others' own laws; a smooth term can look like anything. And what is found after
    the first terms of a series can be what the series leaves.
    """
    mine = _effect_of(found, name)
    own = _gain(found.compared[name], name)
    doubt = 0.0
    for other, comparison in found.compared.items():
        theirs = _effect_of(found, other)
        if other == name or not found.channels[name] & found.channels[other]:
            continue
        left = _is_series(theirs) and _stage_of(found, other) < _stage_of(found, name)
        share = DOUBT_OF_SERIES if left else DOUBT if is_smooth(mine) else 0.0
        doubt = max(doubt, share * _gain(comparison, other))
    return own / max(own + doubt, 1e-9)


def _trust_in_place(found: Search, place: Candidate) -> float:
    """That what stands out at a place is more than the misfit of a law that acts in its channel."""
    channel = place.place.channel.name if place.place is not None else ""
    laws = (_gain(comparison, name) for name, comparison in found.compared.items() if channel in found.channels[name])
    return float(place.twice_gain / max(place.twice_gain + DOUBT * max(laws, default=0.0), 1e-9))


def _effect_of(found: Search, name: str) -> Effect:
    return next(effect for effect in found.found if effect.id == name)


def _stage_of(found: Search, name: str) -> int:
    """In which stage a term was found; after all of them if it took another's place."""
    chosen = [stage.chosen.key if stage.chosen else () for stage in found.stages]
    return next((number for number, key in enumerate(chosen) if name in key), len(chosen))


def _is_series(effect: Effect) -> bool:
    return effect.is_series or is_smooth(effect)


def _gain(comparison: Comparison, name: str) -> float:
    return max((one.twice_gain for one in comparison.candidates if one.effects[0].id == name), default=0.0)


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
    nothing = math.exp(-0.5 * top) * float(np.clip(stage.global_p / NOMINAL, 1e-9, 1e3))
    return nothing / max(nothing + something, 1e-300)

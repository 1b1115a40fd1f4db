"""Whether a further gain is new physics, or only says that a law already found is not quite nature's, or a trifle.

No law is exact, and with enough runs its misfit stands out. It is small beside the effect's own gain, and shows where
the effect shows: in its channels, and above all in what depends on the same things.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from station.diagnosis.inference.columns import Scores
from station.diagnosis.inference.fit import Fit
from station.diagnosis.inference.gain import estimate
from station.diagnosis.likelihood.systematic import is_nuisance
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.search.candidates import Candidate
from station.diagnosis.search.places import Place
from station.physics.effect import Effect, Family
from station.physics.model import Model
from station.physics.smooth import is_smooth

UNNAMED, SAME_FAMILY, OTHER_FAMILY = 0.04, 0.02, 0.01
"""Below these shares of what was found a further gain is the law's misfit: of a smooth term, which can look like
anything; of an effect that looks alike; and of one that looks otherwise."""

BELIEVED = 2.0
"""So many of its standard deviations something that is allowed for may well have."""

DRIFT = 0.002
"""The same of a drift: what is drawn anew for each run has no order, and neither has the misfit of a law of it."""

MOVING: frozenset[Family] = frozenset({"speed law", "timing"})
"""These look alike: a slide's speed grows as the plate turns on, and back."""


@dataclass(frozen=True)
class Gained:
    """Effects (none: a place), in which channels they act, and what they gained (twice the log likelihood)."""

    effects: tuple[Effect, ...]
    channels: frozenset[str]
    twice_gain: float


def gained_by(evidence: Evidence, candidate: Candidate) -> Gained:
    """What a candidate gains, and where."""
    if candidate.place is not None:
        return Gained((), frozenset({candidate.place.channel.name}), candidate.twice_gain)
    return Gained(candidate.effects, channels_of(evidence, candidate.effects), candidate.twice_gain)


def channels_of(evidence: Evidence, effects: Iterable[Effect]) -> frozenset[str]:
    """The channels that effects can change."""
    hooks = frozenset[str]().union(*(effect.acts_through() for effect in effects))
    return frozenset(channel.name for channel in evidence.channels if channel.hooks & hooks)


def is_trifle(evidence: Evidence, without: Fit, fitted: Fit) -> bool:
    """Whether a fit differs from one without some effect by less than any channel is trusted to.

    What is allowed for may stand in for the effect as far as it is believed to, and not farther.
    """
    model = _believable(without.model)
    for channel in evidence.channels:
        apart = channel.residual(fitted.model) - channel.residual(model)
        if len(apart) and float(np.abs(apart).max()) > channel.trusted:
            return False
    return True


def _believable(model: Model) -> Model:
    """The model with what is only allowed for within BELIEVED of its standard deviations."""
    for term in model.terms:
        if is_nuisance(term.effect):
            kept = {
                one.name: min(max(term.values[one.name], one.neutral - reach), one.neutral + reach)
                for one in term.effect.parameters
                for reach in (BELIEVED * one.typical,)
            }
            model = model.with_term(term.with_values(**kept))
    return model


def is_trifling_place(scored: Scores, place: Place) -> bool:
    """Whether what stands out at a place is less than its channel is trusted to."""
    apart = place.basis @ estimate(scored, place.columns)
    return float(np.abs(apart).max(initial=0.0)) < place.channel.trusted


def is_misfit(new: Gained, known: Sequence[Gained]) -> bool:
    """Whether `new` may be no more than the misfit of any that is known."""
    return any(
        new.channels & other.channels and new.twice_gain < _share(new, other) * other.twice_gain for other in known
    )


def _share(new: Gained, other: Gained) -> float:
    unnamed = not new.effects or any(is_smooth(effect) for effect in new.effects)
    if unnamed:
        return UNNAMED
    if any(_alike(one.family, two.family) for one in new.effects for two in other.effects):
        return SAME_FAMILY
    return DRIFT if all(effect.family == "drift" for effect in new.effects) else OTHER_FAMILY


def _alike(one: Family, two: Family) -> bool:
    return one == two or frozenset({one, two}) == MOVING


def superfluous(gains: Mapping[str, Gained]) -> str | None:
    """Of a model's terms the id of the one that gains least beside the others, if it is a misfit of any of them."""
    for name in sorted(gains, key=lambda name: gains[name].twice_gain):
        if is_misfit(gains[name], [other for key, other in gains.items() if key != name]):
            return name
    return None

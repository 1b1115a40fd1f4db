"""Misspecification: whether a gain is new physics, or only shows that a law beside it is not exact.

No law is exact, and with enough runs the difference stands out. A likelihood that takes laws for exact becomes ever
surer of the least wrong one (Miller & Dunson 2019, JASA 114, 1113: coarsened posteriors). Chance makes a gain of about
1 in twice the log likelihood; a law that gains G leaves one of about G / KNOWN_TO. This one number decides how much
better a candidate must be than another for the same place (`temperature`), and which further gain is none
(`is_misfit`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from station.diagnosis import thresholds
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.search.candidates import Candidate
from station.physics.effect import Effect


@dataclass(frozen=True)
class Gained:
    """The channels in which something acts, and its gain in twice the log likelihood."""

    channels: frozenset[str]
    twice_gain: float


def gained_by(evidence: Evidence, candidate: Candidate) -> Gained:
    """A candidate's gain, and the channels in which it acts."""
    if candidate.place is not None:
        return Gained(frozenset({candidate.place.channel.name}), candidate.twice_gain)
    return Gained(_channels_of(evidence, candidate.effects), candidate.twice_gain)


def _channels_of(evidence: Evidence, effects: Iterable[Effect]) -> frozenset[str]:
    """The channels that effects can change."""
    hooks = frozenset[str]().union(*(effect.acts_through() for effect in effects))
    return frozenset(channel.name for channel in evidence.channels if channel.hooks & hooks)


def temperature(gains: Iterable[float]) -> float:
    """The divisor of differences in twice the log likelihood between candidates with such gains for one place."""
    return 1.0 + misfit(gains)


def misfit(gains: Iterable[float]) -> float:
    """The largest gain that laws with such gains leave to others because they are not exact."""
    return max(gains, default=0.0) / thresholds.KNOWN_TO


def is_misfit(new: Gained, known: Iterable[Gained]) -> bool:
    """True if a gain is smaller than what the others leave in its channels because they are not exact."""
    return new.twice_gain < misfit(other.twice_gain for other in known if new.channels & other.channels)


def superfluous(gains: Mapping[str, Gained]) -> str | None:
    """The id of the weakest term whose gain beside the others is their misspecification; None if there is none."""
    for name in sorted(gains, key=lambda name: gains[name].twice_gain):
        if is_misfit(gains[name], [other for key, other in gains.items() if key != name]):
            return name
    return None

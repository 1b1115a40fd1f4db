"""Findings beside the channels' rows, each by a test of its own: blocks that topple, and runs of two kinds."""

from __future__ import annotations

from dataclasses import dataclass

from station.diagnosis.result import EffectFound, Located


@dataclass(frozen=True, eq=False)
class Beside:
    """A finding: its effects, the places where it shows, an upper bound on its p, and what people are told besides."""

    effects: tuple[EffectFound, ...]
    places: tuple[Located, ...]
    p: float
    notes: tuple[str, ...] = ()

    @property
    def none_probability(self) -> float:
        """The probability that none of the effects acts, at most."""
        return 1.0 - max(one.probability for one in self.effects)

"""The tests of friction that depends on a covariate at the onset and while sliding, beside what their levels differ by.

A slide comes after its onset, elsewhere and steeper, so that a drop of friction looks like a change with the place, the
tilt or the time. Where a channel has a level of its own, a smooth term says where friction changes only by what it
gains beside that level.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from station.diagnosis.inference.calibration import Gains
from station.diagnosis.inference.columns import Scores, Variant
from station.diagnosis.inference.gain import gain_beside, overdispersion, p_value
from station.diagnosis.search.places import EVERYWHERE, Place
from station.diagnosis.search.smooth import covariate_of
from station.physics.contact import Array
from station.physics.smooth import Smooth, is_smooth

PHASE_OF = {"onset": "onset", "sliding": "slide"}
"""The phases in which a smooth term acts, by its moments."""


@dataclass(frozen=True, eq=False)
class SharedTerms:
    """The smooth terms of a stage, and the columns of the levels that its channels of friction have of their own."""

    scored: Scores
    variants: Sequence[Variant]
    levels: tuple[int, ...]

    @classmethod
    def of(cls, scored: Scores, places: Sequence[Place]) -> SharedTerms:
        """Returns those of the scores, and the levels among the places."""
        levels = [one.columns for one in places if one.covariate == EVERYWHERE and one.channel.shares_friction]
        smooth = [one for one in scored.variants if is_smooth(one.effect)]
        return cls(scored, smooth, tuple(column for columns in levels for column in columns))

    def gains(self) -> list[Gains]:
        """Returns the tests' gains by scores (K, draws), each a function of these; none where no level stands apart."""
        return [self._gain_of(one) for one in self.variants] if self.levels else []

    def _gain_of(self, variant: Variant) -> Gains:
        def gained(score: Array | None) -> tuple[Array, int]:
            return gain_beside(self.scored, variant.columns, self.levels, score)

        return gained

    def smallest(self) -> Mapping[tuple[str, str], float]:
        """Returns the smallest uncorrected p of the terms, by covariate and by phase in which they act."""
        best = dict[tuple[str, str], float]()
        for variant in self.variants:
            total, size = self._gain_of(variant)(None)
            twice = float(total[0]) / overdispersion(self.scored, variant.columns)
            p = float(p_value(total.clip(twice, twice), size)[0])
            for phase in _phases(variant):
                key = (covariate_of(variant.effect), phase)
                best[key] = min(p, best.get(key, 1.0))
        return best


def _phases(variant: Variant) -> list[str]:
    moments = variant.effect.at if isinstance(variant.effect, Smooth) else PHASE_OF
    return [PHASE_OF[moment] for moment in moments]

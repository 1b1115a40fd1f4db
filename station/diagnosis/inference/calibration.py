"""The session's own null: the distribution of the search's smallest p when the fitted model is the truth."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.inference.columns import Scores, drawn_scores
from station.diagnosis.inference.gain import gain, smallest_p
from station.physics.contact import Array

DRAWS = 1000

Gains = Callable[[Array | None], tuple[Array, int]]
"""Twice the gains (draws,) of a test by scores (K, draws), or by the recording's own, and the test's numbers."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """The smallest p of the whole search in each draw (draws,), in increasing order."""

    smallest: Array

    def corrected(self, p: float) -> float:
        """Returns the probability that the search's smallest p is this small by chance.

        Where fewer than five draws are as small, it is Šidák's correction with the number of independent tests that the
        draws' 5 % quantile implies.
        """
        count = int(np.searchsorted(self.smallest, p, side="right"))
        if count >= 5:
            return (count + 1) / (len(self.smallest) + 1)
        tests = -np.log1p(-0.05) / max(float(np.quantile(self.smallest, 0.05)), 1e-12)
        expected = float(-np.expm1(tests * np.log1p(-min(p, 0.5))))
        return min(max(expected, thresholds.LEAST_P), (count + 1) / (len(self.smallest) + 1))


def calibrate(
    scored: Scores,
    sets: Sequence[Sequence[int]],
    rng: np.random.Generator,
    *,
    further: Iterable[Gains] = (),
    draws: int = DRAWS,
) -> Calibration:
    """Draws recordings from the fitted model and searches all `sets` of columns and the `further` tests in each."""
    drawn = drawn_scores(scored, rng, draws=draws)
    if not sets:
        return Calibration(np.ones(draws))
    gains = [*(gain(scored, columns, drawn) for columns in sets), *(gained(drawn) for gained in further)]
    return Calibration(np.sort(smallest_p(gains)))

"""Turns samples into what simulators can say of them: the limit curve, or one number where there is none."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from shared.messages import Sample
from station.export.from_fit import pair_of_fit
from station.export.measured import MASS_KG, SIDE_M, UNKNOWN, MeasuredPair
from station.friction.limit_curve.of_pair import limit_curve_of
from station.friction.pairs import Pair
from station.friction.results import summarise

_NORMAL_90 = 1.645
_BOOTSTRAPS = 1
"""The fit also judges the family of the scatter by bootstraps; a simulator is not told the family."""


def pair_of_slides(pair: Pair, *, rng: np.random.Generator) -> MeasuredPair | None:
    """Returns a pair's limit curve; the mean of its kept slides where none can be fitted; None where nothing slid.

    `rng` is for the fit's own checks.
    """
    side_m, mass_kg = body_of(pair.samples)
    try:
        fit = limit_curve_of(pair, rng=rng, bootstraps=_BOOTSTRAPS)
    except ValueError as reason:
        return _mean(pair, side_m=side_m, mass_kg=mass_kg, reason=str(reason)) if len(pair.kept) else None
    return pair_of_fit(fit, object=pair.object, plate=pair.plate, side_m=side_m, mass_kg=mass_kg)


def _mean(pair: Pair, *, side_m: float, mass_kg: float, reason: str) -> MeasuredPair:
    summary = summarise(pair.kept)
    error = _NORMAL_90 * summary.mu_sd / math.sqrt(summary.samples)
    interval = (summary.mu - error, summary.mu + error) if math.isfinite(error) else UNKNOWN
    return MeasuredPair(
        object=pair.object,
        plate=pair.plate,
        mu_1=summary.mu,
        mu_2=summary.mu,
        mu_1_interval=interval,
        mu_2_interval=interval,
        scatter=summary.mu_sd / summary.mu,
        samples=summary.samples,
        side_m=side_m,
        mass_kg=mass_kg,
        remarks=(f"{reason} The mean of the samples stands for all directions.",),
    )


def body_of(samples: Sequence[Sample]) -> tuple[float, float]:
    """Returns the side (m) of the square that the object stands on, and its mass (kg).

    They are those of the paper's cube where they are not stated.
    """
    areas = [sample.block_area_m2 for sample in samples if sample.block_area_m2 > 0]
    masses = [sample.block_mass_kg for sample in samples if sample.block_mass_kg > 0]
    side_m = math.sqrt(float(np.median(areas))) if areas else SIDE_M
    return side_m, float(np.median(masses)) if masses else MASS_KG

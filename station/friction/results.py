"""Computes the results of each surface pair: numbers, tests and sentences."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from station.friction.anisotropy import AnisotropyTest, Relation, anisotropy_test, can_test, holm
from station.friction.direction import Array
from station.friction.filters import FilterCounts, count
from station.friction.limit_curve.curve import LimitCurveFit
from station.friction.limit_curve.of_pair import limit_curve_of
from station.friction.pairs import Pair
from station.friction.slides import Slides


@dataclass(frozen=True, slots=True)
class Summary:
    """Mean and standard deviation (n − 1) of theta and mu; NaN below one and two samples.

    `scatter` is the standard deviation of theta over its mean, `standard_error_rad` that of the mean.
    """

    samples: int
    theta_rad: float
    theta_sd_rad: float
    mu: float
    mu_sd: float

    @property
    def scatter(self) -> float:
        """Relative scatter, as the paper gives it."""
        return self.theta_sd_rad / self.theta_rad

    @property
    def standard_error_rad(self) -> float:
        """The standard error of the mean theta."""
        return self.theta_sd_rad / math.sqrt(self.samples) if self.samples else math.nan


@dataclass(frozen=True, eq=False, kw_only=True)
class PairResult:
    """A pair's results. `directions` are by the tilting direction (−1: free azimuth); tests are None if impossible.

    `with_limit_curves` adds `limit_curve`, or in `no_limit_curve` a sentence that says why there is none.
    """

    pair: Pair
    summary: Summary
    directions: dict[int, Summary]
    counts: FilterCounts
    robust_counts: FilterCounts
    object_test: AnisotropyTest | None
    plate_test: AnisotropyTest | None
    limit_curve: LimitCurveFit | None = None
    no_limit_curve: str = ""


def summarise(slides: Slides) -> Summary:
    """Returns the summary of slides, which should be the kept ones."""
    theta, theta_sd = _moments(slides.theta_rad)
    mu, mu_sd = _moments(slides.mu)
    return Summary(len(slides), theta, theta_sd, mu, mu_sd)


def _moments(values: Array) -> tuple[float, float]:
    mean = float(values.mean()) if len(values) else math.nan
    return mean, float(values.std(ddof=1)) if len(values) > 1 else math.nan


def analyse(pairs: Sequence[Pair], *, rng: np.random.Generator) -> tuple[PairResult, ...]:
    """Returns the results of all pairs, in their order; p-values are adjusted for all the tests that were made."""
    results = [_result(pair, rng) for pair in pairs]
    adjusted = iter(holm([test for result in results for test in _tests(result) if test is not None]))
    # In the order in which they were collected: each pair's two tests, those that were possible.
    return tuple(
        replace(
            result,
            object_test=next(adjusted) if result.object_test is not None else None,
            plate_test=next(adjusted) if result.plate_test is not None else None,
        )
        for result in results
    )


def _tests(result: PairResult) -> tuple[AnisotropyTest | None, AnisotropyTest | None]:
    return result.object_test, result.plate_test


def _result(pair: Pair, rng: np.random.Generator) -> PairResult:
    kept = pair.kept
    return PairResult(
        pair=pair,
        summary=summarise(kept),
        directions={
            int(number): summarise(kept.where(kept.direction == number)) for number in np.unique(kept.direction)
        },
        counts=count(pair.flags),
        robust_counts=count(pair.robust),
        object_test=_test(kept, "object", rng),
        plate_test=_test(kept, "plate", rng),
    )


def _test(kept: Slides, relation: Relation, rng: np.random.Generator) -> AnisotropyTest | None:
    return anisotropy_test(kept, relation, rng=rng) if can_test(kept, relation) else None


def with_limit_curves(results: Sequence[PairResult], *, rng: np.random.Generator) -> tuple[PairResult, ...]:
    """Returns the results with the limit curve of each pair, which takes about as long as everything else together."""
    found: list[PairResult] = []
    for result in results:
        curve, why_not = _limit_curve(result.pair, rng)
        found.append(replace(result, limit_curve=curve, no_limit_curve=why_not))
    return tuple(found)


def _limit_curve(pair: Pair, rng: np.random.Generator) -> tuple[LimitCurveFit | None, str]:
    try:
        return limit_curve_of(pair, rng=rng), ""
    except ValueError as error:
        return None, str(error)


def limit_curve_table(results: Sequence[PairResult]) -> dict[str, Any]:
    """Returns the contents of `limit_curves.json`.

    For each pair it has its fit (`LimitCurveFit.as_dict`), or why there is none.
    """
    return {
        "version": 1,
        "pairs": [
            {
                "object": result.pair.object,
                "plate": result.pair.plate,
                "fit": None if result.limit_curve is None else result.limit_curve.as_dict(),
                "no_fit": result.no_limit_curve,
            }
            for result in results
        ],
    }

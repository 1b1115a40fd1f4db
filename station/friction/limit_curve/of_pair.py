"""A surface pair's limit curve, from its samples."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from station.friction.limit_curve.choice import Choice, choose
from station.friction.limit_curve.curve import Estimate, LimitCurveFit
from station.friction.limit_curve.estimates import band_of, estimates_of
from station.friction.limit_curve.families import BOOTSTRAPS, Multipliers, choose_family
from station.friction.limit_curve.likelihood import Likelihood
from station.friction.limit_curve.maximise import Maximum
from station.friction.limit_curve.observations import Observations, observations_of, uncounted
from station.friction.pairs import Pair
from station.friction.report_table import percent

_COARSE = 0.3
_STRAIGHT = 0.7
"""An ease that is surely below this is not a pull that exceeds what holds by a little."""


@lru_cache(maxsize=8)
def chosen_curve(pair: Pair) -> Choice:
    """Returns the curve of a pair; kept, as both the analysis and its figure ask for it.

    Raises:
        ValueError: saying in a sentence why no curve can be fitted.
    """
    return choose(observations_of(pair), uncounted=uncounted(pair))


def limit_curve_of(pair: Pair, *, rng: np.random.Generator, bootstraps: int = BOOTSTRAPS) -> LimitCurveFit:
    """Returns the limit curve of a pair with its scatter; `rng` is for the goodness of fit.

    Raises:
        ValueError: saying in a sentence why no curve can be fitted.
    """
    return fit_of(chosen_curve(pair), observations_of(pair), rng=rng, bootstraps=bootstraps)


def fit_of(
    choice: Choice, observations: Observations, *, rng: np.random.Generator, bootstraps: int = BOOTSTRAPS
) -> LimitCurveFit:
    """Returns the result of a choice between curves, with the distribution of the scatter about the best of them."""
    best = choice.best
    multiplier, goodness = choose_family(multipliers(best, observations), rng=rng, bootstraps=bootstraps)
    estimates = estimates_of(best)
    bracketed = ~observations.resolved & ~observations.censored
    return LimitCurveFit(
        curve=best.layout.curve(best.values),
        kind=best.layout.kind,
        estimates=estimates,
        multiplier=multiplier,
        goodness=goodness,
        scores=choice.scores,
        band=band_of(best),
        slides=int(observations.resolved.sum()),
        censored=int(observations.censored.sum()),
        bracketed=int(bracketed.sum()),
        p_isotropic=choice.p_isotropic,
        remarks=(*choice.remarks, *_remarks(best, observations, estimates)),
    )


def multipliers(fit: Maximum, observations: Observations) -> Multipliers:
    """Returns each run's friction over what the curve expects of it, drift included."""
    expected = Likelihood(fit.layout, observations).expected_pull(fit.values)
    return Multipliers(
        value=np.exp(observations.pull - expected),
        above=np.exp(observations.above - expected),
        below=np.exp(observations.below - expected),
    )


def _remarks(fit: Maximum, observations: Observations, estimates: Mapping[str, Estimate]) -> list[str]:
    remarks = list[str]()
    ease = estimates.get("ease")
    if ease is not None and ease.high < _STRAIGHT:
        remarks.append(
            f"the block slid straighter than maximum dissipation says (it turned aside {max(ease.value, 0.0):.2f} "
            f"times as far, at most {max(ease.high, 0.0):.2f}), so that the limit by pull is what was measured, and µ "
            "by the direction of the slide only what follows from the same curve"
        )
    scatter = float(np.exp(fit.values[fit.layout.index("log_scatter")]))
    error = float(np.median(observations.pull_sigma))
    if error > _COARSE * scatter:
        remarks.append(
            f"the error of an onset ({percent(error)} of µ) is not small beside the scatter ({percent(scatter)}), and "
            "is part of the distribution of the multiplier, though not of the scatter"
        )
    return remarks

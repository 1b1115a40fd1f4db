"""A surface pair's limit curve, from its samples."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from station.friction.limit_curve.choice import Choice, choose
from station.friction.limit_curve.curve import LimitCurveFit
from station.friction.limit_curve.estimates import band_of, estimates_of
from station.friction.limit_curve.families import BOOTSTRAPS, Multipliers, choose_family
from station.friction.limit_curve.likelihood import Likelihood
from station.friction.limit_curve.maximise import Maximum
from station.friction.limit_curve.observations import Observations, observations_of
from station.friction.pairs import Pair

_COARSE = 0.3


@lru_cache(maxsize=8)
def chosen_curve(pair: Pair) -> Choice:
    """The curve of a pair; kept, as both the analysis and its figure ask for it.

    Raises:
        ValueError: saying in a sentence why no curve can be fitted.
    """
    return choose(observations_of(pair))


def limit_curve_of(pair: Pair, *, rng: np.random.Generator, bootstraps: int = BOOTSTRAPS) -> LimitCurveFit:
    """The limit curve of a pair with its scatter; `rng` is for the goodness of fit.

    Raises:
        ValueError: saying in a sentence why no curve can be fitted.
    """
    return fit_of(chosen_curve(pair), observations_of(pair), rng=rng, bootstraps=bootstraps)


def fit_of(
    choice: Choice, observations: Observations, *, rng: np.random.Generator, bootstraps: int = BOOTSTRAPS
) -> LimitCurveFit:
    """The result of a choice between curves, with the distribution of the scatter about the best of them."""
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
        remarks=(*choice.remarks, *_remarks(best, observations)),
    )


def multipliers(fit: Maximum, observations: Observations) -> Multipliers:
    """Each run's friction over what the curve expects of it, drift included."""
    expected = Likelihood(fit.layout, observations).expected_pull(fit.values)
    return Multipliers(
        value=np.exp(observations.pull - expected),
        above=np.exp(observations.above - expected),
        below=np.exp(observations.below - expected),
    )


def _remarks(fit: Maximum, observations: Observations) -> tuple[str, ...]:
    scatter = float(np.exp(fit.values[fit.layout.index("log_scatter")]))
    error = float(np.median(observations.pull_sigma))
    if error < _COARSE * scatter:
        return ()
    return (
        f"the error of an onset ({error:.1%} of µ) is not small beside the scatter ({scatter:.1%}), and is part of the "
        "distribution of the multiplier, though not of the scatter",
    )

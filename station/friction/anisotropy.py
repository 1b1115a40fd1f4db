"""Tests if friction depends on the direction: p-value, effect size, and the size that chance alone gives.

The logarithm of mu is regressed on harmonics of the sliding direction phi (Fisher's F test of nested linear models):

    ln mu = a + b run + sum over k = 1, 2 of (c_k cos k phi + s_k sin k phi)

k = 2 is what an ellipse has, k = 1 is one-way friction. `run`, the position in the session, takes up wear and drift,
which would otherwise pass for a direction whenever the block turns slowly. Beside the F test stands the permutation of
residuals (Freedman and Lane, 1983), which does not need normal scatter and also says which ratio of highest to lowest
friction chance alone gives. Runs that ended without a slide take no part.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, cast

import numpy as np
from scipy.special import fdtrc

from station.friction.direction import Array
from station.friction.slides import Slides

Relation = Literal["object", "plate"]
ORDERS = (1, 2)
LEAST_SAMPLES = 25
"""The paper's own number before it trusts a mean and a standard deviation."""
PERMUTATIONS = 2000
ONE_DIRECTION = 0.9
"""Resultant length of the doubled directions above which they are all within about 13° of one line."""
CONFOUNDED = 0.9
"""The same of the block's orientations against the plate: object and plate turn together."""
_WEAK = 0.1
"""Root mean square below which a combination of harmonics hardly varies over the samples, and is left out."""
_GRID = 72


@dataclass(frozen=True, eq=False)
class Harmonics:
    """A fit of ln mu: `mu` (k,) at the directions `grid_rad` (k,) that were sampled, for the middle of the session.

    `explained` and `rest` are sums of squares with `df` and `df_rest` degrees of freedom. `scores` (n, df) are
    orthonormal columns that span the harmonics over the samples, `on_grid` (k, df) the same at `grid_rad`.
    """

    grid_rad: Array
    mu: Array
    df: int
    df_rest: int
    explained: float
    rest: float
    residuals: Array
    scores: Array
    on_grid: Array

    @property
    def f(self) -> float:
        """F statistic."""
        return (self.explained / self.df) / (self.rest / self.df_rest)

    @property
    def p_value(self) -> float:
        """The p-value of the F test."""
        return float(fdtrc(self.df, self.df_rest, self.f))

    @property
    def ratio(self) -> float:
        """Highest over lowest fitted mu among the sampled directions."""
        return float(self.mu.max() / self.mu.min())


@dataclass(frozen=True, slots=True)
class AnisotropyTest:
    """The test's result. `ratio`: highest over lowest fitted mu; chance alone exceeds `ratio_by_chance` in 5 %.

    `p_value` is the permutation's and `p_f` the F test's; `p_given_other` the F test's with the harmonics of the other
    relation (plate for object) taken out first, NaN where the two cannot be told apart. `omega2` is the share of the
    variance of ln mu that the direction explains, corrected for the number of terms; `highest_rad` is the direction of
    the highest friction. `p_adjusted` is corrected for the number of tests made together (Holm).
    """

    relation: Relation
    samples: int
    p_value: float
    p_f: float
    p_given_other: float
    omega2: float
    ratio: float
    ratio_by_chance: float
    highest_rad: float
    df: int
    p_adjusted: float = math.nan


def resultant(direction_rad: Array) -> float:
    """Gives length, 0 to 1, of the mean of the unit vectors at twice `direction_rad` (n,): 1 if all lie on one line."""
    known = direction_rad[np.isfinite(direction_rad)]
    return float(abs(np.exp(2j * known).mean())) if len(known) else 1.0


def directions_of(slides: Slides, relation: Relation) -> Array:
    """Returns the sliding directions (n,) against the object or the plate, 360°."""
    return slides.object_rad if relation == "object" else slides.plate_rad


def can_test(slides: Slides, relation: Relation) -> bool:
    """Returns true if there are enough slides, in more than one direction."""
    known = slides.where(np.isfinite(slides.object_rad) & (slides.mu > 0))
    return len(known) >= LEAST_SAMPLES and resultant(directions_of(known, relation)) < ONE_DIRECTION


def fit_harmonics(slides: Slides, relation: Relation, *, given_other: bool = False) -> Harmonics:
    """Fits the regression to slides that can be tested (`can_test`).

    Raises:
        ValueError: if they cannot, or if (with `given_other`) nothing of the harmonics is left.
    """
    if not can_test(slides, relation):
        raise ValueError("expected at least 25 slides in more than one direction")
    known = slides.where(np.isfinite(slides.object_rad) & (slides.mu > 0))
    direction, count = directions_of(known, relation), len(known)
    nuisance = [np.ones(count), np.linspace(-1, 1, count)]
    if given_other:
        nuisance += list(_harmonics(directions_of(known, "plate" if relation == "object" else "object")).T)
    basis = _orthonormal(np.column_stack(nuisance))
    log_mu = np.log(known.mu)
    residuals = log_mu - basis @ (basis.T @ log_mu)
    columns = _harmonics(direction)
    free = columns - basis @ (basis.T @ columns)
    left, size, right = np.linalg.svd(free, full_matrices=False)
    strong = size > _WEAK * math.sqrt(count)
    if not strong.any():
        raise ValueError("nothing of the harmonics is left beside the other direction's")
    scores = left[:, strong]
    weights = scores.T @ residuals
    grid = _sampled(direction)
    centred = _harmonics(grid) - columns.mean(axis=0)
    on_grid = (centred @ right.T[:, strong]) / size[strong]
    explained = float(weights @ weights)
    return Harmonics(
        grid_rad=grid,
        mu=np.exp(log_mu.mean() + on_grid @ weights),
        df=int(strong.sum()),
        df_rest=count - basis.shape[1] - int(strong.sum()),
        explained=explained,
        # If there is no scatter only rounding is left, of which no ratio may be formed.
        rest=max(float(residuals @ residuals) - explained, 1e-20 * count),
        residuals=residuals,
        scores=scores,
        on_grid=on_grid,
    )


def _harmonics(direction: Array) -> Array:
    return np.column_stack([wave(k * direction) for k in ORDERS for wave in (np.cos, np.sin)])


def _orthonormal(columns: Array) -> Array:
    left, size, _ = np.linalg.svd(columns, full_matrices=False)
    return left[:, size > _WEAK * math.sqrt(len(columns))]


def _sampled(direction: Array) -> Array:
    """Returns the middles of the parts of the circle that hold samples: elsewhere a fit is a guess."""
    width = 2 * math.pi / _GRID
    return cast(Array, (np.unique((direction // width).astype(np.int64) % _GRID) + 0.5) * width)


def anisotropy_test(
    slides: Slides, relation: Relation = "object", *, rng: np.random.Generator, permutations: int = PERMUTATIONS
) -> AnisotropyTest:
    """Tests whether mu depends on the sliding direction against the object, or against the plate.

    Raises:
        ValueError: if it cannot be tested (`can_test`).
    """
    fit = fit_harmonics(slides, relation)
    explained, ratios = _by_chance(fit, rng, permutations)
    beaten = int((explained >= fit.explained * (1 - 1e-12)).sum())
    variance = fit.rest / fit.df_rest
    return AnisotropyTest(
        relation=relation,
        samples=len(fit.residuals),
        p_value=(1 + beaten) / (1 + permutations),
        p_f=fit.p_value,
        p_given_other=_given_other(slides, relation),
        omega2=max(0.0, (fit.explained - fit.df * variance) / (fit.explained + fit.rest + variance)),
        ratio=fit.ratio,
        ratio_by_chance=float(np.quantile(ratios, 0.95)),
        highest_rad=float(fit.grid_rad[np.argmax(fit.mu)]),
        df=fit.df,
    )


def _by_chance(fit: Harmonics, rng: np.random.Generator, permutations: int) -> tuple[Array, Array]:
    """Returns explained squares and ratios of highest to lowest mu (permutations) with the residuals dealt out anew."""
    weights = np.array([rng.permutation(fit.residuals) @ fit.scores for _ in range(permutations)])
    curves = weights @ fit.on_grid.T
    return cast(Array, (weights**2).sum(axis=1)), cast(Array, np.exp(np.ptp(curves, axis=1)))


def _given_other(slides: Slides, relation: Relation) -> float:
    known = np.isfinite(slides.orientation_rad)
    if resultant(slides.orientation_rad[known]) > CONFOUNDED:
        return math.nan
    try:
        return fit_harmonics(slides, relation, given_other=True).p_value
    except ValueError:
        return math.nan


def holm(tests: list[AnisotropyTest]) -> list[AnisotropyTest]:
    """Returns the tests with their p-values adjusted for having been made together (Holm, 1979), in the same order."""
    order = sorted(range(len(tests)), key=lambda index: tests[index].p_value)
    adjusted, worst = dict[int, float](), 0.0
    for rank, index in enumerate(order):
        worst = max(worst, min(1.0, (len(tests) - rank) * tests[index].p_value))
        adjusted[index] = worst
    return [replace(test, p_adjusted=adjusted[index]) for index, test in enumerate(tests)]

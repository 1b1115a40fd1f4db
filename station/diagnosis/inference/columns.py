"""Score tests: every candidate as whitened slopes around a fitted model, orthogonal to what the model absorbs."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.inference.fit import Fit, shaking_of
from station.diagnosis.inference.fit import fit as fit_model
from station.diagnosis.inference.parameters import Free, told
from station.diagnosis.likelihood.slopes import differences, near, residuals, slopes
from station.diagnosis.likelihood.student import pulls
from station.diagnosis.likelihood.whitening import Whitening, stack
from station.diagnosis.observations.evidence import Evidence
from station.physics.contact import Array
from station.physics.effect import Effect
from station.physics.model import Model, Term
from station.physics.parameter import Parameter

MOST_VARIANTS = 12
ROUGH = 3
"""The Newton steps by which mu_s and the nuisances follow a term at one of its sizes."""

HOPELESS, ABSORBED = 1e-4, 1e-7
"""A column is set to zero if its information is below HOPELESS (a hundred typical sizes would not show), or if the
other columns leave a smaller share of it than ABSORBED: the rest is rounding, and rounding correlates with anything.
"""


@dataclass(frozen=True, eq=False)
class Variant:
    """An effect at its null, or at one of its `sizes`, with its shapes at one of their starts, and its columns.

    `numbers` counts the effect's parameters that are identifiable in these runs, shapes among them. `twice_gain` is
    what it brings at that size, in twice the log likelihood, where `at_sizes` has found it: slopes say nothing of a law
    that sets in beyond a size, or of residuals that a tail of the noise takes for outliers.
    """

    effect: Effect
    start: Term
    columns: tuple[int, ...]
    numbers: int
    twice_gain: float = 0.0


@dataclass(frozen=True, eq=False, kw_only=True)
class Scores:
    """Information (K, K) and score (K,) of K columns around a fitted model, with the model's own numbers projected out.

    `of_runs` (clusters, K) are the shares of independent runs, groups or stretches of the score; `low`, `high` (K,) are
    the bounds of a column's number relative to its null; `runs` is the number of runs that count.
    """

    variants: tuple[Variant, ...]
    information: Array
    score: Array
    of_runs: Array
    low: Array
    high: Array
    runs: int


def variants_of(evidence: Evidence, effects: Iterable[Effect]) -> list[tuple[Effect, Term]]:
    """Each effect with each combination of its sizes and of the starts of its identifiable shapes.

    There are at most MOST_VARIANTS of each effect.
    """
    found: list[tuple[Effect, Term]] = []
    for effect in effects:
        shapes = [parameter for parameter in told(evidence, effect) if parameter.is_shape]
        sized = [parameter for parameter in effect.parameters if parameter.sizes]
        grids = [_grid(shapes), *([_grid([*shapes, *sized])] if sized else [])]
        for values in itertools.islice(itertools.chain(*grids), MOST_VARIANTS):
            found.append((effect, Term(effect, {**effect.neutral(), **values})))
    return found


def _grid(parameters: Sequence[Parameter]) -> Iterator[dict[str, float]]:
    """Each combination of the parameters' sizes or starts, by their names."""
    for values in itertools.product(*(one.sizes or one.starts for one in parameters)):
        yield dict(zip((one.name for one in parameters), values, strict=True))


@dataclass(frozen=True, eq=False, kw_only=True)
class Looked:
    """The change of each row by K numbers of effects: slopes `table` (rows, K), one column for each number.

    `low`, `high` (K,) are the bounds of a number relative to its null. Slopes do not depend on the noise.
    """

    variants: tuple[Variant, ...]
    table: Array
    low: Array
    high: Array

    def of(self, effects: Sequence[Effect]) -> Looked:
        """The slopes of some of the effects."""
        chosen = [one for one in self.variants if any(one.effect is effect for effect in effects)]
        columns = [column for one in chosen for column in one.columns]
        ends = itertools.accumulate((len(one.columns) for one in chosen), initial=0)
        variants = [
            replace(one, columns=tuple(range(begin, begin + len(one.columns))))
            for one, begin in zip(chosen, ends, strict=False)
        ]
        table, low, high = self.table[:, columns], self.low[columns], self.high[columns]
        return Looked(variants=tuple(variants), table=table, low=low, high=high)


def looked(evidence: Evidence, model: Model, effects: Iterable[Effect]) -> Looked:
    """The slopes of all variants of the effects around a model."""
    at = residuals(evidence, model)
    parts, variants, low, high = list[Array](), list[Variant](), list[float](), list[float]()
    with near(evidence, model):  # an effect at its null changes nothing
        for effect, start in variants_of(evidence, effects):
            free = tuple(Free(effect, parameter) for parameter in effect.parameters if not parameter.is_shape)
            null = Term(effect, {**start.values, **_null_sizes(effect)})
            parts.append(stack(evidence, differences(evidence, model.with_term(null), free, at)))
            columns = tuple(range(len(low), len(low) + len(free)))
            variants.append(Variant(effect, start, columns, len(told(evidence, effect))))
            begin = [null.values[number.parameter.name] / number.scale for number in free if number.parameter]
            low += [number.low - value for number, value in zip(free, begin, strict=True)]
            high += [number.high - value for number, value in zip(free, begin, strict=True)]
    table = np.column_stack(parts) if parts else np.zeros((len(stack(evidence, at)), 0))
    return Looked(variants=tuple(variants), table=table, low=np.array(low), high=np.array(high))


def scores(evidence: Evidence, fit: Fit, effects: Sequence[Effect], extra: Array | None = None) -> Scores:
    """The scores of all variants of the effects, then of the `extra` columns (rows, E)."""
    return scores_of(evidence, fit, looked(evidence, fit.model, effects), extra)


def scores_of(evidence: Evidence, fit: Fit, seen: Looked, extra: Array | None = None) -> Scores:
    """The scores of slopes around a fit, then of the `extra` columns (rows, E), which have no bounds."""
    at = residuals(evidence, fit.model)
    whitening = Whitening(evidence, fit.noise, shaking=shaking_of(evidence, fit.model))
    white = whitening(stack(evidence, at))
    own = stack(evidence, slopes(evidence, fit.model, fit.free, at))
    beside = np.zeros((len(own), 0)) if extra is None else extra
    unbound = np.full(beside.shape[1], np.inf)
    counted = evidence.counted[whitening.run]
    # The tables are the largest that a diagnosis needs, so that they are changed in place.
    table = whitening(np.column_stack([own, seen.table, beside]))
    table = table if counted.all() else table[counted]
    cluster, tail = evidence.cluster[whitening.run][counted], whitening.tail[counted]
    slope, _ = pulls(white[counted], tail, whitening.limit[counted])
    expected = np.where(tail >= thresholds.GAUSSIAN, 1.0, (tail + 1) / (tail + 3))
    weighted = np.sqrt(expected)[:, None] * table
    nuisance, candidates = weighted[:, : len(fit.free)], weighted[:, len(fit.free) :]
    precision = np.array([number.precision for number in fit.free])
    prior = np.diag(precision)
    projection = np.linalg.pinv(nuisance.T @ nuisance + prior, hermitian=True) @ (nuisance.T @ candidates)
    whole = np.square(candidates).sum(axis=0)
    free_of = np.subtract(candidates, nuisance @ projection, out=candidates)
    left = np.square(free_of).sum(axis=0) + precision @ projection**2
    known = left > np.maximum(HOPELESS, ABSORBED * whole)
    free_of *= known
    projection = projection * known
    # A nuisance that absorbs a candidate is held back by its prior: that resistance speaks for the candidate.
    information = free_of.T @ free_of + projection.T @ prior @ projection
    del weighted, nuisance, candidates, free_of
    share = table[:, len(fit.free) :]
    share -= table[:, : len(fit.free)] @ projection
    share *= known
    share *= -slope[:, None]
    of_runs = np.zeros((evidence.runs, share.shape[1]))
    np.add.at(of_runs, cluster, share)
    return Scores(
        variants=seen.variants,
        information=information,
        score=share.sum(axis=0) + projection.T @ (precision * fit.vector),
        of_runs=of_runs[np.unique(evidence.cluster[evidence.counted])],
        low=np.concatenate([seen.low, -unbound]),
        high=np.concatenate([seen.high, unbound]),
        runs=int(evidence.counted.sum()),
    )


def at_sizes(evidence: Evidence, fit: Fit, scored: Scores) -> Scores:
    """The same scores, whose variants at a size have their `twice_gain`; it takes a short fit for each of them."""
    gained = (replace(one, twice_gain=_twice_gain(evidence, fit, one.start)) for one in scored.variants)
    return replace(scored, variants=tuple(gained))


def _null_sizes(effect: Effect) -> dict[str, float]:
    """The null values of those parameters that have sizes."""
    return {one.name: one.neutral for one in effect.parameters if one.sizes}


def _twice_gain(evidence: Evidence, current: Fit, start: Term) -> float:
    """Twice what the log likelihood gains by a term at one of its sizes, mu_s and nuisances alone fitted anew; or 0."""
    if all(start.values[name] == null for name, null in _null_sizes(start.effect).items()):
        return 0.0
    tried = current.model.with_term(start)
    found = fit_model(evidence, tried, (), noise=current.noise, refine=False, steps=ROUGH)
    return max(2.0 * (found.log_likelihood - current.log_likelihood), 0.0)


def drawn_scores(scored: Scores, rng: np.random.Generator, *, draws: int) -> Array:
    """Scores (K, draws) of recordings that are drawn from the fitted model.

    A score is a sum over hundreds of rows of bounded influence, so it is Gaussian with the information as its
    covariance. Columns are drawn in units of their own size: beside a column that a channel without noise knows to
    many digits, the rounding of the others would else be larger than they are.
    """
    own = np.sqrt(np.diag(scored.information))
    own = np.where(own > 0.0, own, 1.0)
    size, axes = np.linalg.eigh(scored.information / np.outer(own, own))
    normal = rng.standard_normal((len(size), draws))
    return own[:, None] * (axes @ (np.sqrt(np.maximum(size, 0.0))[:, None] * normal))

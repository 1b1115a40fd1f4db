"""Score tests: every candidate as whitened slopes around a fitted model, orthogonal to what the model absorbs."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from station.diagnosis.inference.climb import CONVERGED, Climb
from station.diagnosis.inference.fit import Fit
from station.diagnosis.inference.noise_of import shaking_of
from station.diagnosis.inference.parameters import Free, free_numbers, identifiable
from station.diagnosis.inference.sparse import Index, Sloped, side_by_side, sloped
from station.diagnosis.likelihood.feedback import owed_slope
from station.diagnosis.likelihood.slopes import decay_differences, decays, differences, near, residuals, slopes
from station.diagnosis.likelihood.student import expected_information, pulls
from station.diagnosis.likelihood.whitening import PART_ROWS, Whitening, stack
from station.diagnosis.observations.evidence import Evidence
from station.physics.contact import Array, Bools
from station.physics.effect import Effect
from station.physics.model import Model, Term
from station.physics.parameter import Parameter

MOST_VARIANTS = 18
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


@dataclass(frozen=True, eq=False)
class Absorbed:
    """The parts of K columns that a model's k numbers absorb: their `projection` (k, K) on these numbers.

    `own` (k, k) is the numbers' information by the data, and `precision` (k,) that of their priors.
    """

    own: Array
    precision: Array
    projection: Array

    @cached_property
    def resisted(self) -> Array:
        """The information (K, K) about the columns by the priors, which resist what the numbers absorb."""
        return (self.precision[:, None] * self.projection).T @ self.projection


@dataclass(frozen=True, eq=False, kw_only=True)
class Scores:
    """Information (K, K) and score (K,) of K columns around a fitted model, with the model's own numbers projected out.

    `of_runs` (clusters, K) are the shares of independent runs, groups or stretches of the score; `low`, `high` (K,) are
    the bounds of a column's number relative to its null; `runs` is the number of runs that count. `rows` (K,) is the
    number of whitened rows that carry a column: (Σ s²)² / Σ s⁴, which is m where m rows have it alike and others not.
    `absorbed` are the parts of the columns that the model's own numbers have.
    """

    variants: tuple[Variant, ...]
    information: Array
    score: Array
    of_runs: Array
    low: Array
    high: Array
    runs: float
    rows: Array
    absorbed: Absorbed

    def in_runs(self, runs: float) -> Scores:
        """Returns the same columns in another number of `runs`, with their information and what the model absorbs.

        Data grow with the runs, priors do not: in few runs a nuisance's prior keeps it from absorbing what it absorbs
        in many.
        """
        more, own, precision = runs / self.runs, self.absorbed.own, np.diag(self.absorbed.precision)
        had = self.absorbed.projection
        left = precision @ had  # the model's numbers times what they leave of the columns
        projection = np.linalg.pinv(own + precision / more, hermitian=True) @ (own @ had + left)
        change = projection - had
        crossed = left.T @ change
        data = self.information - self.absorbed.resisted - crossed - crossed.T + change.T @ own @ change
        absorbed = replace(self.absorbed, own=more * own, projection=projection)
        information = more * data + absorbed.resisted
        return replace(self, information=information, absorbed=absorbed, runs=runs, rows=more * self.rows)


def variants_of(evidence: Evidence, effects: Iterable[Effect]) -> list[tuple[Effect, Term]]:
    """Returns each effect with each combination of its sizes and of the starts of its identifiable shapes.

    There are at most MOST_VARIANTS of each effect.
    """
    found: list[tuple[Effect, Term]] = []
    for effect in effects:
        shapes = [parameter for parameter in identifiable(evidence, effect) if parameter.is_shape]
        sized = [parameter for parameter in effect.parameters if parameter.sizes]
        grids = [_grid(shapes), *([_grid([*shapes, *sized])] if sized else [])]
        for values in itertools.islice(itertools.chain(*grids), MOST_VARIANTS):
            found.append((effect, Term(effect, {**effect.neutral(), **values})))
    return found


def _grid(parameters: Sequence[Parameter]) -> Iterator[dict[str, float]]:
    """Yields each combination of the parameters' sizes or starts, by their names."""
    for values in itertools.product(*(one.sizes or one.starts for one in parameters)):
        yield dict(zip((one.name for one in parameters), values, strict=True))


@dataclass(frozen=True, eq=False, kw_only=True)
class Looked:
    """The change of each row by K numbers of effects: slopes, a `table` of one column for each number.

    `low`, `high` (K,) are the bounds of a number relative to its null. Slopes do not depend on the noise.
    """

    variants: tuple[Variant, ...]
    table: Sloped
    low: Array
    high: Array

    def of(self, effects: Sequence[Effect]) -> Looked:
        """Returns the slopes of some of the effects."""
        chosen = [one for one in self.variants if any(one.effect is effect for effect in effects)]
        columns = [column for one in chosen for column in one.columns]
        ends = itertools.accumulate((len(one.columns) for one in chosen), initial=0)
        variants = [
            replace(one, columns=tuple(range(begin, begin + len(one.columns))))
            for one, begin in zip(chosen, ends, strict=False)
        ]
        table, low, high = self.table.chosen(columns), self.low[columns], self.high[columns]
        return Looked(variants=tuple(variants), table=table, low=low, high=high)


def looked(evidence: Evidence, model: Model, effects: Iterable[Effect]) -> Looked:
    """Returns the slopes of all variants of the effects around a model."""
    at = residuals(evidence, model)
    parts, variants, low, high = list[Sloped](), list[Variant](), list[float](), list[float]()
    with near(evidence, model):  # an effect at its null changes nothing
        for effect, start in variants_of(evidence, effects):
            free = tuple(Free(effect, parameter) for parameter in effect.parameters if not parameter.is_shape)
            null = Term(effect, {**start.values, **_null_sizes(effect)})
            around = model.with_term(null)
            undone = decay_differences(evidence, around, free)
            parts.append(sloped(evidence, differences(evidence, around, free, at), len(free), undone))
            columns = tuple(range(len(low), len(low) + len(free)))
            variants.append(Variant(effect, start, columns, len(identifiable(evidence, effect))))
            begin = [null.values[number.parameter.name] / number.scale for number in free if number.parameter]
            low += [number.low - value for number, value in zip(free, begin, strict=True)]
            high += [number.high - value for number, value in zip(free, begin, strict=True)]
    table = side_by_side(evidence, parts)
    return Looked(variants=tuple(variants), table=table, low=np.array(low), high=np.array(high))


def scores(evidence: Evidence, fit: Fit, effects: Sequence[Effect], extra: Sloped | None = None) -> Scores:
    """Returns the scores of all variants of the effects, then of the `extra` columns."""
    return scores_of(evidence, fit, looked(evidence, fit.model, effects), extra)


def scores_of(evidence: Evidence, fit: Fit, seen: Looked, extra: Sloped | None = None) -> Scores:
    """Returns the scores of slopes around a fit, then of the `extra` columns, which have no bounds."""
    beside = sloped(evidence, {}, 0) if extra is None else extra
    unbound = np.full(beside.rows.shape[1], np.inf)
    precision = np.array([number.precision for number in fit.free])
    columns = _Columns(evidence, fit, seen.table.beside(beside))
    own, projection, whole = columns.projected(fit, precision)
    information, of_runs, fourth = columns.free_of(projection)
    rows = np.square(np.diag(information)) / np.maximum(fourth, np.finfo(np.float64).tiny)
    left = np.diag(information) + precision @ projection**2
    known = left > np.maximum(HOPELESS, ABSORBED * whole)
    projection = projection * known
    # A nuisance that absorbs a candidate is held back by its prior: that resistance speaks for the candidate.
    absorbed = Absorbed(own, precision, projection)
    information = information * np.outer(known, known) + absorbed.resisted
    of_runs *= known
    return Scores(
        variants=seen.variants,
        information=information,
        score=of_runs.sum(axis=0) + projection.T @ (precision * fit.vector),
        of_runs=of_runs[np.unique(evidence.cluster[evidence.counted])],
        low=np.concatenate([seen.low, -unbound]),
        high=np.concatenate([seen.high, unbound]),
        runs=int(evidence.counted.sum()),
        rows=rows,
        absorbed=absorbed,
    )


_Part = tuple[Index, Array, Array]


class _Columns:
    """The model's own slopes (rows, k) and the candidates' (rows, K), whitened some runs at a time.

    In full they would be the largest arrays that a diagnosis needs; those of few rows are kept, as they are asked for
    twice.
    """

    def __init__(self, evidence: Evidence, fit: Fit, candidates: Sloped) -> None:
        at = residuals(evidence, fit.model)
        own = slopes(evidence, fit.model, fit.free, at)
        self._own = len(fit.free)
        undone = decay_differences(evidence, fit.model, fit.free)
        self._table, self._decay = sloped(evidence, own, self._own, undone).beside(candidates)
        self._whitening = Whitening(evidence, fit.noise, shaking=shaking_of(evidence, fit.model))
        self._counted = evidence.counted[self._whitening.run]
        self._cluster, self._runs = evidence.cluster[self._whitening.run], evidence.runs
        self._of_decay = owed_slope(self._whitening, decays(evidence, fit.model))
        self._owed_own = self._of_decay[self._counted] @ stack(evidence, undone)[self._counted]
        tail = self._whitening.tail
        self._slope, curvature = pulls(self._whitening(stack(evidence, at)), tail, self._whitening.limit)
        self._weight = np.sqrt(expected_information(curvature, tail, self._whitening.limit))[:, None]

    def _parts(self) -> Iterable[_Part]:
        """Returns rows (m,) that count, the model's own columns (m, k) and the candidates' (m, K) there."""
        return self._white() if len(self._counted) > PART_ROWS else self._kept

    @cached_property
    def _kept(self) -> Sequence[_Part]:
        return tuple(self._white())

    def _white(self) -> Iterator[_Part]:
        for rows, whiten in self._whitening.parts():
            counted = self._counted[rows]
            white = whiten(self._table.of(rows))[counted]
            yield rows[counted], white[:, : self._own], white[:, self._own :]

    def _owed(self, rows: Index) -> Array:
        """Returns the slopes (m, k + K) of what rows (m,) owe to their own motion."""
        return self._of_decay[rows][:, None] * self._decay.of(rows)

    def projected(self, fit: Fit, precision: Array) -> tuple[Array, Array, Array]:
        """Returns the own numbers' information (k, k), the candidates' projection (k, K) on them, and information (K,).

        A number that the data push against its bound is held there, and absorbs nothing: an adhesion that is not
        negative leaves what an offset of the angle has in common with it.
        """
        among = np.zeros((self._own, self._own))
        across = np.zeros((self._own, self._table.shape[1] - self._own))
        whole, score = np.zeros(across.shape[1]), self._owed_own - precision * fit.vector
        for rows, own, candidates in self._parts():
            nuisance, weighted = self._weight[rows] * own, self._weight[rows] * candidates
            among = among + nuisance.T @ nuisance
            across += nuisance.T @ weighted
            whole += np.square(weighted).sum(axis=0)
            score -= self._slope[rows] @ own
        free = ~pushed_out(fit, score)
        among, across = among * np.outer(free, free), across * free[:, None]
        return among, np.linalg.pinv(among + np.diag(precision), hermitian=True) @ across, whole

    def free_of(self, projection: Array) -> tuple[Array, Array, Array]:
        """Returns the candidates' information (K, K) beside the model, score by cluster (runs, K), and Σ s⁴ (K,)."""
        information = np.zeros((projection.shape[1], projection.shape[1]))
        of_runs, fourth = np.zeros((self._runs, projection.shape[1])), np.zeros(projection.shape[1])
        for rows, own, candidates in self._parts():
            left = candidates - own @ projection
            weighted = self._weight[rows] * left
            information += weighted.T @ weighted
            fourth += (weighted**2 * weighted**2).sum(axis=0)
            owed = self._owed(rows)
            share = owed[:, self._own :] - owed[:, : self._own] @ projection
            np.add.at(of_runs, self._cluster[rows], share - self._slope[rows][:, None] * left)
        return information, of_runs, fourth


def pushed_out(fit: Fit, score: Array) -> Bools:
    """Returns the numbers (k,) at a bound beyond which their `score` (k,) says that the likelihood rises."""
    low, high = (np.array([getattr(number, end) for number in fit.free]) for end in ("low", "high"))
    return (fit.vector <= low) & (score < 0.0) | (fit.vector >= high) & (score > 0.0)


def at_sizes(evidence: Evidence, fit: Fit, scored: Scores) -> Scores:
    """Returns the same scores, whose variants at a size have their `twice_gain`.

    It takes a short fit for each of them.
    """
    model = fit.model
    free = free_numbers(evidence, model, ())
    slope = stack(evidence, slopes(evidence, model, free, residuals(evidence, model)))
    gained = (replace(one, twice_gain=_twice_gain(evidence, fit, one.start, slope)) for one in scored.variants)
    return replace(scored, variants=tuple(gained))


def _null_sizes(effect: Effect) -> dict[str, float]:
    """Returns the null values of those parameters that have sizes."""
    return {one.name: one.neutral for one in effect.parameters if one.sizes}


def _twice_gain(evidence: Evidence, current: Fit, start: Term, slope: Array) -> float:
    """Returns twice what the log likelihood gains by a term at one of its sizes, or 0.

    Only mu_s and the nuisances are fitted anew.

    `slope` (rows, k) has the current model's slopes by these. Most terms at most sizes fit far worse than none: a climb
    that does not promise to come back to where it left is not begun.
    """
    if all(start.values[name] == null for name, null in _null_sizes(start.effect).items()):
        return 0.0
    tried = current.model.with_term(start)
    climb = Climb(evidence, tried, free_numbers(evidence, tried, ()), noise=current.noise, slope=slope)
    if climb.promised() <= current.log_likelihood:
        return 0.0
    climb.climb(ROUGH, CONVERGED)
    return max(2.0 * (climb.log_likelihood - current.log_likelihood), 0.0)


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

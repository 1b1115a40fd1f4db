"""The likelihood that a set of columns would gain by its score, for one recording or for many drawn ones."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from station.diagnosis import thresholds
from station.diagnosis.inference.columns import Scores
from station.physics.contact import Array, Bools

SINGULAR = 1e-8
"""Columns whose information falls below this share of their own, given the others, count as absorbed."""


def gain(scored: Scores, columns: Sequence[int], score: Array | None = None) -> tuple[Array, int]:
    """Returns twice the gain in log likelihood (draws,) within the columns' bounds, and the number of columns.

    `score` (m, draws) are drawn scores of all m columns that `scored` has; None: the recording's own, with draws = 1.
    They have no unit. Columns whose null is a bound and whose step would cross it are held there, and the rest is
    solved again; draws and recording are treated alike.
    """
    own = scored.score[:, None] if score is None else score
    if len(columns) == 1:
        return _alone(scored, columns[0], own[columns[0]]), 1
    chosen, size, scaled = _scaled(scored, columns)
    part = own[chosen] / size[:, None]
    step = np.linalg.solve(scaled, part)
    total = np.maximum((part * step).sum(axis=0), 0.0)
    sided = (scored.low[chosen] > -1e-9) | (scored.high[chosen] < 1e-9)
    if not sided.any():
        return total, len(chosen)
    outside = ((step < 0) & (scored.low[chosen] > -1e-9)[:, None]) | (
        (step > 0) & (scored.high[chosen] < 1e-9)[:, None]
    )
    bad = outside.any(axis=0)
    if bad.any():
        total[bad] = _held(scored, chosen, own[:, bad], outside[:, bad])
    return total, len(chosen)


def gain_beside(
    scored: Scores, columns: Sequence[int], beside: Sequence[int], score: Array | None = None
) -> tuple[Array, int]:
    """Returns twice the gain (draws,) of the columns once others `beside` them are free, and the columns' number.

    `score` (m, draws) are scores as `gain` takes them; they have no unit.
    """
    if not beside:
        return gain(scored, columns, score)
    whole, least = gain(scored, [*columns, *beside], score)[0], gain(scored, beside, score)[0]
    return np.maximum(whole - least, 0.0), len(columns)


def _alone(scored: Scores, column: int, own: Array) -> Array:
    """Returns the gains (draws,) of a single column by its scores (draws,).

    Most candidates are one, and need no solver.
    """
    information = scored.information[column, column]
    size = _size(information)
    part = own / size
    step = part / (information / (size * size) + SINGULAR)
    crossing = (step < 0) & (scored.low[column] > -1e-9) | (step > 0) & (scored.high[column] < 1e-9)
    return np.where(crossing, 0.0, np.maximum(part * step, 0.0))


def estimate(scored: Scores, columns: Sequence[int]) -> Array:
    """Returns the columns' numbers (k,) at the maximum of the likelihood's quadratic model, clipped to their bounds."""
    chosen, size, scaled = _scaled(scored, columns)
    step = np.linalg.solve(scaled, scored.score[chosen] / size) / size
    return np.clip(step, scored.low[chosen], scored.high[chosen])


def _scaled(scored: Scores, columns: Sequence[int]) -> tuple[NDArray[np.int64], Array, Array]:
    """Gives the columns (k,), the square roots of their information, and that information (k, k) in units of these."""
    chosen = np.asarray(columns, dtype=np.int64)
    information = scored.information[chosen[:, None], chosen]
    size = _size(np.diag(information))
    return chosen, size, information / np.outer(size, size) + SINGULAR * np.eye(len(chosen))


def _size(information: Array) -> Array:
    """Gives the square roots (k,) of columns' information (k,); one without any gets a size that scales it to zero."""
    return np.where(information > 1e-9, np.sqrt(np.maximum(information, 1e-9)), 1e15)


def _held(scored: Scores, chosen: NDArray[np.int64], own: Array, outside: Bools) -> Array:
    """Returns the gains (draws,) without the columns that `outside` (k, draws) marks as crossing their bounds."""
    found = np.zeros(own.shape[1])
    for pattern in np.unique(outside, axis=1).T:
        same = (outside == pattern[:, None]).all(axis=0)
        rest = chosen[~pattern]
        if len(rest):
            found[same] = gain(scored, rest.tolist(), own[:, same])[0]
    return found


def overdispersion(scored: Scores, columns: Sequence[int]) -> float:
    """Returns the ratio (at least 1) of the scatter of the runs' shares of the score to what the likelihood expects.

    The shares' mean, which is the gain, is taken off. The ratio guards against dependence within runs that the noise
    model does not know: it is a sandwich variance, of which only a significant excess counts.
    """
    chosen, size, scaled = _scaled(scored, columns)
    shares = scored.of_runs[:, chosen] / size
    centred = shares - shares.mean(axis=0)
    scatter = centred.T @ centred
    ratio = float(np.trace(np.linalg.solve(scaled, scatter))) / len(chosen)
    # With few runs the ratio itself is noisy: only an excess over its own standard error counts.
    active = max(float((np.abs(shares).sum(axis=1) > 0).sum()), 2.0)
    return max(ratio - thresholds.OVERDISPERSED * np.sqrt(2.0 / active), 1.0)


def p_value(total: Array, size: int) -> Array:
    """Returns the asymptotic p-value (n,) of `total` (n,), twice a gain, with `size` numbers: chi-squared."""
    return chdtrc(size, total)


def smallest_p(gains: Iterable[tuple[Array, int]]) -> Array:
    """Returns the smallest p-value (n,) of many gains (n,) with their numbers.

    Of gains with equally many numbers the largest has the smallest p: one function of chi-squared stands for hundreds.
    """
    largest: dict[int, Array] = {}
    for total, size in gains:
        largest[size] = np.maximum(largest[size], total) if size in largest else total
    return np.min([p_value(total, size) for size, total in largest.items()], axis=0)

"""Straight lines through edge points, four edges at a time, and the corners where they meet.

Points of the image are complex numbers x + i y; edge k of a quadrilateral that is clockwise as seen runs from corner k
to corner k + 1, and its outward normal is −i times its tangent.
"""

from functools import lru_cache
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Points = NDArray[np.complex128]
EdgeVariance = list[tuple[float, float]]

TUKEY = 4.0  # residuals beyond so many deviations count nothing
MAD_TO_SIGMA = 1.4826
NEXT = np.array([1, 2, 3, 0])
BEFORE = np.array([3, 0, 1, 2])


class Edges(NamedTuple):
    """The expected edges: start and unit tangent (4,), length (4,), and the part of it that is read (4,)."""

    start: Points
    tangent: Points
    length: Floats
    free: Floats

    @property
    def middle(self) -> Points:
        """The middles of the edges (4,)."""
        return self.start + (0.5 * self.length) * self.tangent


class LineFit(NamedTuple):
    """Lines, one for each edge.

    Outward offset at the edge's middle and rise along its free part (4,); weights, residuals (4, n) and the moments of
    the weights (4, 3).
    """

    offset: Floats
    rise: Floats
    weight: Floats
    residual: Floats
    moments: Floats


def expected_edges(corners: Points, *, clear_px: float) -> Edges:
    """Returns the edges between corners (4,), read `clear_px` clear of both ends (at least a third of each is read)."""
    step = corners[NEXT] - corners
    length = np.abs(step)
    return Edges(corners, step / length, length, _read(length, clear_px))


def shortened(edges: Edges, *, clear_px: float) -> Edges:
    """Returns the same edges, read at another distance from both ends."""
    return edges._replace(free=_read(edges.length, clear_px))


def _read(length: Floats, clear_px: float) -> Floats:
    return np.maximum(length - 2.0 * clear_px, 0.33 * length)


@lru_cache(maxsize=8)
def places(count: int) -> Floats:
    """Returns the places of an edge's points along its free part (count,): −0.5 … 0.5."""
    return (np.arange(count) + 0.5) / count - 0.5


@lru_cache(maxsize=8)
def powers(count: int) -> Floats:
    """Returns powers 0, 1, 2 of the places (count, 3)."""
    return places(count)[:, None] ** np.arange(3)


@lru_cache(maxsize=8)
def _pairs(count: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    pairs = [(a, b) for a, b in combinations(range(count), 2) if b - a >= count // 3]
    first, second = np.array(pairs, dtype=np.intp).T
    return first, second


def vote(offset: Floats, weight: Floats, *, tolerance: float, largest_rise: Floats) -> tuple[Floats, Floats]:
    """Returns the line of each edge that most points agree with: offset and rise (4,), px.

    Tries the line through every pair of points that are not close together; right with up to half the points astray.

    Args:
        offset: (4, n) the points' places outwards, px.
        weight: (4, n) how much each point counts.
        tolerance: distance from which a point no longer agrees, px.
        largest_rise: (4,) the most that a line may rise along its edge's free part, px.
    """
    place = places(offset.shape[1])
    first, second = _pairs(len(place))
    rise = (offset[:, second] - offset[:, first]) / (place[second] - place[first])
    middle = offset[:, first] - rise * place[first]
    distance = np.abs(offset[:, None, :] - middle[:, :, None] - rise[:, :, None] * place)
    score = np.matmul(np.maximum(1.0 - distance / tolerance, 0.0), weight[:, :, None])[:, :, 0]
    score[np.abs(rise) > largest_rise[:, None]] = -1.0
    best = np.argmax(score, axis=1)
    edge = np.arange(4)
    return middle[edge, best], rise[edge, best]


def fit_lines(
    offset: Floats, weight: Floats, *, start: tuple[Floats, Floats] | None, floor_px: float, rounds: int
) -> LineFit:
    """Returns robust straight lines (Tukey's biweight) through points, from a line to start with or least squares.

    Args:
        offset: (4, n) the points' places outwards, px.
        weight: (4, n) how much each point counts; 0 leaves it out.
        start: offset and rise (4,) of the lines to start with, px; None: those of least squares.
        floor_px: the smallest deviation believed, px.
        rounds: how often the weights are renewed.
    """
    count = offset.shape[1]
    basis = powers(count)
    slopes = basis[:, :2].T
    # Weights are above, their products with the offsets below: one product of matrices sums them all.
    both = np.empty((8, count))
    current, product = both[:4], both[4:]
    current[:], product[:] = weight, weight * offset
    sums = both @ basis
    # As long as no point is left out, the middle one is the same for all edges.
    out = None if min(sums[:4, 0].tolist()) > count - 0.5 else weight <= 0
    line = _solved(sums[:4], sums[4:]) if start is None else np.stack(start, axis=1)
    for _ in range(rounds):
        residual = offset - line @ slopes
        scale = np.maximum(_deviation(residual, out), floor_px)
        ratio = residual * (1.0 / (TUKEY * scale))[:, None]
        ratio *= ratio
        np.subtract(1.0, ratio, out=ratio)
        np.maximum(ratio, 0.0, out=current)
        current *= current
        current *= weight
        np.multiply(current, offset, out=product)
        sums = both @ basis
        line = _solved(sums[:4], sums[4:])
    return LineFit(line[:, 0], line[:, 1], current, offset - line @ slopes, sums[:4])


def weighted(offset: Floats, fit: LineFit) -> Floats:
    """Returns offset and rise (4, 2) by least squares through other points `offset` (4, n), px, by a fit's weights."""
    return _solved(fit.moments, (fit.weight * offset) @ powers(offset.shape[1]))


def along(terms: Floats, *, count: int) -> Floats:
    """Returns the points (k, count) of lines or parabolas: `terms` (k, 2) or (k, 3), px, by the powers of the place."""
    return terms @ powers(count)[:, : terms.shape[1]].T


def _deviation(residual: Floats, out: NDArray[np.bool_] | None) -> Floats:
    """Returns the robust deviation (4,) of the points not left out: 1.48 × their median distance from the line."""
    distance = np.abs(residual)
    if out is None:
        distance.sort(axis=1)
        return MAD_TO_SIGMA * distance[:, (distance.shape[1] - 1) // 2]
    distance[out] = np.inf
    distance.sort(axis=1)
    counted = np.add.reduce(~out, axis=1)
    return MAD_TO_SIGMA * distance[np.arange(4), np.maximum(counted - 1, 0) // 2]


def _solved(moments: Floats, products: Floats) -> Floats:
    """Solves weighted least squares for offset and rise (4, 2).

    The moments (4, 3) of each edge's weights, and of the weights times the offsets. Plain numbers: for four edges they
    are faster than arrays.
    """
    lines = []
    for (s0, s1, s2), (first, second, _) in zip(moments.tolist(), products.tolist(), strict=True):
        total = s0 + 1e-9
        rise = (second * total - first * s1) / (total * s2 - s1 * s1 + 1e-9)
        lines.append(((first - rise * s1) / total, rise))
    return np.array(lines)


def intersect(edges: Edges, offset: Floats, rise: Floats) -> Points:
    """Gives corners (4,), px, where the edges k − 1 and k meet that were moved by `offset` (4,) and `rise` (4,), px."""
    lines = []
    parts = (edges.start, edges.tangent, edges.length, edges.free, offset, rise)
    for start, tangent, length, free, out, lift in zip(*(part.tolist() for part in parts), strict=True):
        lines.append((start + tangent * complex(0.5 * length, -out), tangent * complex(1.0, -lift / free)))
    corners = []
    before_point, before_along = lines[3]
    for point, along in lines:
        before = before_along.conjugate()
        corners.append(point - along * ((before * (point - before_point)).imag / (before * along).imag))
        before_point, before_along = point, along
    return np.array(corners)


def scatter_variance(fit: LineFit, edges: Edges, *, variance: Floats | None = None) -> Floats:
    """Gives the variance (4,) of a coordinate of each corner (px²), from the scatter of edge points about their lines.

    Neighbouring points share pixels and texture: their correlation, taken from the residuals of all edges together,
    enlarges the scatter of a line. `variance` (4,): of the points, None for that of each edge's own.
    """
    own = point_variance(fit) if variance is None else variance
    return _inflation(fit) * at_corners(own, fit, edges)


def at_corners(variance: Floats, fit: LineFit, edges: Edges) -> Floats:
    """Returns the variance (4,) of a coordinate of each corner if each edge point has the variance (4,) of its own."""
    return np.array(at_corners_and_edges(variance, fit, edges, everywhere=0.0)[0])


def at_corners_and_edges(
    variance: Floats, fit: LineFit, edges: Edges, *, everywhere: float
) -> tuple[list[float], EdgeVariance]:
    """Gives the variances of `at_corners`, and those of each edge's offset at its middle and rise between corners, px².

    A corner moves with the ends of the two lines that meet there, each across itself.

    Args:
        variance: (4,) the variance of each edge's points, px².
        fit: the lines of the four edges.
        edges: where the edges are.
        everywhere: what is added to the variance of every corner, px².
    """
    ends, of_edges = [], []
    parts = (fit.moments, 0.5 * edges.length / edges.free, variance)
    for (s0, s1, s2), half, each in zip(*(part.tolist() for part in parts), strict=True):
        mean = s1 / s0
        middle, spread = each / s0, each / (s2 - s1 * mean)
        ends.append((middle + (half + mean) ** 2 * spread, middle + (half - mean) ** 2 * spread))
        of_edges.append(
            (middle + mean * mean * spread + 0.5 * everywhere, 4.0 * half * half * spread + 2.0 * everywhere)
        )
    return [0.5 * (ends[edge][0] + ends[edge - 1][1]) + everywhere for edge in range(4)], of_edges


def point_variance(fit: LineFit) -> Floats:
    """Returns the variance of the points about their lines (4,)."""
    squared = fit.weight * fit.residual * fit.residual
    return np.add.reduce(squared, axis=1) / np.maximum(fit.moments[:, 0] - 2.0, 1.0)


def _inflation(fit: LineFit) -> float:
    """Returns the ratio of a mean's variance to that of as many independent points (at least 1)."""
    share = fit.residual * np.sqrt(fit.weight)
    power = float(np.vdot(share, share)) + 1e-12
    factor = 1.0
    for lag in (1, 2, 3):
        both = float(np.einsum("ei,ei->", share[:, lag:], share[:, :-lag])) / power
        if both <= 0.05:
            break
        factor += 2.0 * both
    return factor

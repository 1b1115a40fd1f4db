"""Straight lines through edge points, four at a time, and the corners where they meet."""

from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

TUKEY = 4.0  # residuals beyond so many deviations count nothing
MAD_TO_SIGMA = 1.4826


class Frames(NamedTuple):
    """The predicted edges: start, unit tangent and outward normal (4, 2), length (4,)."""

    start: Floats
    tangent: Floats
    normal: Floats
    length: Floats


class LineFit(NamedTuple):
    """Offsets from the predicted edges: at their middle (4,) and slope (4,); weights and residuals (4, n)."""

    offset: Floats
    slope: Floats
    weight: Floats
    residual: Floats


def edge_frames(corners: Floats) -> Frames:
    """The edges of a quadrilateral (4, 2) given clockwise as seen: edge k runs from corner k to corner k + 1."""
    step = corners[[1, 2, 3, 0]] - corners
    length = np.sqrt(step[:, 0] ** 2 + step[:, 1] ** 2)
    tangent = step / length[:, None]
    normal = np.empty_like(tangent)
    normal[:, 0], normal[:, 1] = tangent[:, 1], -tangent[:, 0]
    return Frames(corners, tangent, normal, length)


def vote(offset: Floats, along: Floats, weight: Floats, *, tolerance: float) -> tuple[Floats, Floats]:
    """The line of each edge that most points agree with: offset and slope (4,).

    Tries the line through every pair of points (4, n) that are not close together; right with up to half of the
    points astray.
    """
    first, second = _pairs(offset.shape[1])
    gap = along[:, second] - along[:, first]
    slope = (offset[:, second] - offset[:, first]) / gap
    middle = offset[:, first] - slope * along[:, first]
    distance = np.abs(offset[:, None, :] - middle[:, :, None] - slope[:, :, None] * along[:, None, :])
    score = np.einsum("epn,en->ep", np.maximum(1.0 - distance / tolerance, 0.0), weight)
    score[np.abs(slope) > 0.3] = -1.0
    best = np.argmax(score, axis=1)
    edge = np.arange(4)
    return middle[edge, best], slope[edge, best]


_PAIRS: dict[int, tuple[NDArray[np.intp], NDArray[np.intp]]] = {}


def _pairs(count: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    if count not in _PAIRS:
        pairs = [(a, b) for a, b in combinations(range(count), 2) if b - a >= count // 3]
        first, second = np.array(pairs, dtype=np.intp).T
        _PAIRS[count] = (first, second)
    return _PAIRS[count]


def fit_lines(
    offset: Floats, along: Floats, weight: Floats, *, start: tuple[Floats, Floats], floor_px: float, rounds: int = 3
) -> LineFit:
    """Robust straight lines (Tukey's biweight) through the points (4, n) of each edge, from a line to start with.

    `weight` 0 leaves a point out; `floor_px` is the smallest deviation believed.
    """
    middle, slope = start
    current = weight
    residual = offset
    for _ in range(rounds):
        residual = offset - middle[:, None] - slope[:, None] * along
        scale = np.maximum(_deviation(residual, weight), floor_px)
        ratio = residual / (TUKEY * scale[:, None])
        current = weight * np.maximum(1.0 - ratio * ratio, 0.0) ** 2
        middle, slope = _weighted_line(offset, along, current)
    residual = offset - middle[:, None] - slope[:, None] * along
    return LineFit(middle, slope, current, residual)


def _deviation(residual: Floats, weight: Floats) -> Floats:
    """Robust deviation (4,) of the points that count: 1.48 × their median distance from the line."""
    distance = np.where(weight > 0, np.abs(residual), np.inf)
    distance.sort(axis=1)
    middle = np.maximum((np.count_nonzero(weight > 0, axis=1) - 1) // 2, 0)
    median = distance[np.arange(4), middle]
    return np.where(np.isfinite(median), MAD_TO_SIGMA * median, 0.0)


def _weighted_line(offset: Floats, along: Floats, weight: Floats) -> tuple[Floats, Floats]:
    total = weight.sum(axis=1) + 1e-9
    weighted = weight * along
    mean_along = weighted.sum(axis=1) / total
    mean_offset = (weight * offset).sum(axis=1) / total
    spread = (weighted * along).sum(axis=1) - total * mean_along**2
    cross = (weighted * offset).sum(axis=1) - total * mean_along * mean_offset
    slope = cross / (spread + 1e-9)
    return mean_offset - slope * mean_along, slope


def intersect(frames: Frames, middle: Floats, slope: Floats) -> Floats:
    """Corners (4, 2) where the shifted edges k − 1 and k meet; middles are offsets at half the edge's length."""
    point = frames.start + 0.5 * frames.length[:, None] * frames.tangent + middle[:, None] * frames.normal
    along = frames.tangent + slope[:, None] * frames.normal
    before_point, before_along = point[[3, 0, 1, 2]], along[[3, 0, 1, 2]]
    gap = point - before_point
    cross = before_along[:, 0] * along[:, 1] - before_along[:, 1] * along[:, 0]
    reach = (gap[:, 0] * along[:, 1] - gap[:, 1] * along[:, 0]) / cross
    return before_point + reach[:, None] * before_along


def corner_sigma(fit: LineFit, along: Floats, length: Floats) -> float:
    """Standard deviation of one coordinate of a corner (px), from the scatter of the edge points about their lines.

    A corner moves with the ends of the two lines that meet there. Neighbouring points share pixels and texture:
    their correlation, taken from the residuals of all edges together, enlarges the scatter of a line.
    """
    total = fit.weight.sum(axis=1)
    weighted = fit.weight * along
    mean = weighted.sum(axis=1) / total
    spread = (weighted * along).sum(axis=1) - total * mean**2
    variance = (fit.weight * fit.residual**2).sum(axis=1) / np.maximum(total - 2.0, 1.0)
    half = 0.5 * length
    ends = 2.0 / total + ((half - mean) ** 2 + (half + mean) ** 2) / spread
    return float(np.sqrt(_inflation(fit) * np.mean(variance * ends) / 2.0))


def _inflation(fit: LineFit) -> float:
    """How much larger the variance of a mean is than that of as many independent points (at least 1)."""
    share = fit.residual * np.sqrt(fit.weight)
    power = float(np.sum(share * share)) + 1e-12
    factor = 1.0
    for lag in (1, 2, 3):
        both = float(np.sum(share[:, lag:] * share[:, :-lag])) / power
        if both <= 0.05:
            break
        factor += 2.0 * both
    return factor

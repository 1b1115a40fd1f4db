"""The covariance model of a fit: the errors of corners and edges, with those that the points' scatter does not show.

Uneven light along an edge, and the edge of something else beside it, move many points alike.
"""

from functools import lru_cache
from math import ceil, sqrt
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking import lines

Floats = NDArray[np.float64]
Matrix = NDArray[np.float32]
Integers = NDArray[np.intp]
Points = NDArray[np.complex128]

# These are the shares, beside a textured plate, that make up the variance of an edge's points (what varies slowly
# along it, and the scatter of all points) and that of the corners (the disagreement of two estimators that mind texture
# unlike each other, a blur that is not the other edges', and the noise of a blur that only this frame tells). They were
# found by maximum likelihood from rendered frames of all kinds, other ones than the benchmark's.
TEXTURE_SLOW, TEXTURE_SCATTER, TEXTURE_PULL, TEXTURE_BLUR, TEXTURE_BLUR_NOISE = 0.59, 0.44, 0.088, 1.07, 0.45
SEEN_IN_PART = 1.4  # factor on the variance of the points of an edge that is seen in part
IN_PART = 0.7  # share of the profiles: an edge with a smaller sum of weights is seen in part
WHOLE_EDGE = 0.85  # share of its profiles that agree, beyond which nothing covers an edge
OTHER_CONTRAST = 0.25  # relative difference from the other edges' contrast that the plate's own shades do not make
LIGHTER = 0.04  # excess of an edge's dark, in contrasts, that is not the mark's
WHOLE = 0.75  # share of an edge that must be seen for a disagreement along it to be a shadow's
IN_SHADOW = 0.1  # relative difference of the light on two halves of edges that a shadow makes
SHADED = 16.0  # squared deviations from which a disagreement along an edge is a shadow's
PULL_NOISE = 3.3  # disagreement that noise makes, in shares of the scatter
SHADOW_SHARE = 0.47  # error by a shadow along an edge beside an even margin, in shares of the disagreement
HIDDEN = 1.5  # factor on the scatter for what a shadow hides in the noise
SYSTEMATIC_PX = 0.003  # error that is left of sampling and of a blur that is not quite Gaussian
SYSTEMATIC_ON_TEXTURE_PX = 0.0025  # the same beside a textured plate
ROUNDING_PX = 0.2  # error by rounding to whole levels of light, times the contrast (of 255): no scatter shows it
ROUNDING_ON_TEXTURE_PX = 0.34  # the same beside a textured plate, where the scatter lacks some of dim light's noise
NOISY = 20.0  # contrast (of 255) above which light's own noise spreads the levels: rounding is then in the scatter
MOTION_BLUR = 0.001  # error of a corner by a path within the exposure, in shares of the path
MOTION_BLUR_ON_TEXTURE = 0.004  # the same beside a textured plate, where motion blurs an edge in another form
AGREES = 0.3  # weight from which a profile agrees with its line
BENT = 5, 6.0  # neighbouring profiles, and the length of edge (px), that never disagree alike by chance
BENT_END_PX = 0.1  # an edge whose last three profiles all lie so far beside its line has another one's direction,
BENT_END = 6.0  # if that is also so many deviations of its points: texture bends the ends of edges
BENT_LEAST_PX = 0.06  # a profile that lies so far beside its line may show another edge,
BENT_BY_TEXTURE = 0.3  # if it is also this share of the blur away: a streak or a pore of the plate moves an edge as far
COVERED_BLURS = 2.5  # blur deviations by which a thing's own blurred edge spoils the profiles beside it
_OPPOSITE = np.array([2, 3, 0, 1])
_ENDS = np.array([[0, 1, 2], [-1, -2, -3]])


class Sigmas(NamedTuple):
    """Sigma of a corner's coordinate (px) of all corners, and of the worst.

    `pulled`: whether two estimators disagree by more than their noise; `edges`: the variances of the lines.
    """

    mean_px: float
    worst_px: float
    pulled: bool = False
    edges: lines.EdgeVariance | None = None


def beside_a_gap(line: lines.LineFit, *, blur_px: float, shortest_px: float) -> NDArray[np.bool_] | None:
    """Returns profiles (4, n) that are spoiled by what covers their neighbours; None when none is.

    At the end of an edge a single such profile would turn the whole line.
    """
    gap = line.weight < AGREES
    runs = _three_on_end(gap)
    if not runs.any():
        return None
    reach = ceil(COVERED_BLURS * blur_px * gap.shape[1] / shortest_px)
    covered = np.zeros(gap.shape, dtype=np.uint8)
    covered[:, 1:-1] = runs
    return np.asarray(cv2.dilate(covered, np.ones((1, 2 * reach + 3), dtype=np.uint8))) > 0


def _three_on_end(marked: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Returns the places where a profile and both neighbours are marked, without the first and the last (4, n − 2)."""
    return marked[:, 2:] & marked[:, 1:-1] & marked[:, :-2]


def bent(line: lines.LineFit, profile_weight: Floats, *, shortest_px: float, texture_px: Floats) -> bool:
    """Returns true if neighbours on an edge all show an edge on the same side of its line.

    There are then two edges, and one of them is not the mark's.

    Args:
        line: the lines of the four edges.
        profile_weight: (4, n) the weight of each profile, 0 to 1.
        shortest_px: the shortest edge, px.
        texture_px: (4,) the width of each edge by all blur beside a textured plate, px; else 0.
    """
    beside_line = line.weight < AGREES
    if max(np.add.reduce(beside_line, axis=1).tolist()) < _ENDS.shape[1]:
        return False
    profiles, length_px = BENT
    run = max(profiles, ceil(line.weight.shape[1] * length_px / shortest_px))
    if run >= line.weight.shape[1]:
        return False
    least_px = np.full(line.weight.shape, BENT_LEAST_PX)
    # A thing that covers an edge leaves some of it to be seen at an end; in between, streaks disagree more often.
    least_px[:, run:-run] += BENT_BY_TEXTURE * texture_px[:, None]
    # Beside a sharp edge a compressed video's blocks disagree by hundredths of a pixel, which harms nobody.
    disagree = (profile_weight > 0) & beside_line & (np.abs(line.residual) > least_px)
    if not _three_on_end(disagree).any():
        return False
    at_ends = line.residual[:, _ENDS] * disagree[:, _ENDS]
    limit_px = np.maximum(BENT_END_PX, BENT_END * np.sqrt(lines.point_variance(line)))
    if np.any(np.maximum(at_ends.min(axis=2), -at_ends.max(axis=2)) > limit_px[:, None]):
        return True
    beside = np.sign(line.residual) * disagree
    total = np.add.accumulate(beside, axis=1)
    return bool(np.abs(total[:, run:] - total[:, :-run]).max() >= run)


def another(line: lines.LineFit, agreeing: Integers, *, contrast: Matrix, dark: Matrix) -> bool:
    """Returns true if an edge that is seen in part has another contrast than the others, beside a textured plate.

    It is that of what covers the edge, unless the dark differs as much: that makes a shadow.

    Args:
        line: the lines of the four edges.
        agreeing: (4,) how many profiles of each edge agree with its line.
        contrast: (4, n) the profiles' contrast, of 255.
        dark: (4, n) the profiles' dark level, of 255.
    """
    whole = WHOLE_EDGE * line.weight.shape[1]
    if min(agreeing.tolist()) > whole:
        return False
    differs, shaded = _beside_usual(line, contrast), _beside_usual(line, dark)
    return bool(np.any((agreeing <= whole) & (differs > OTHER_CONTRAST) & (shaded < 0.5 * differs)))


def covering(line: lines.LineFit, agreeing: Integers, *, contrast: Matrix, dark: Matrix) -> bool:
    """Returns true if an edge seen in part has a lighter dark than the others, and not by light, beside an even margin.

    What covers an edge along it has an edge of its own, as straight. A shadow changes the dark as it changes the
    contrast, and a highlight makes the margin as much lighter.

    Args:
        line: the lines of the four edges.
        agreeing: (4,) how many profiles of each edge agree with its line.
        contrast: (4, n) the profiles' contrast, of 255.
        dark: (4, n) the profiles' dark level, of 255.
    """
    whole = WHOLE_EDGE * line.weight.shape[1]
    if min(agreeing.tolist()) > whole:
        return False
    total = line.moments[:, 0]
    light, own = (np.add.reduce(line.weight * values, axis=1) / total for values in (contrast, dark))
    lighter = own - _middle_two(own / light) * light
    margin = own + light
    return bool(
        np.any((agreeing <= whole) & (lighter > LIGHTER * light) & (margin - _middle_two(margin) < 0.5 * lighter))
    )


def _beside_usual(line: lines.LineFit, values: Matrix) -> Floats:
    """Returns the distance of each edge's mean (4,) from that of the middle two, in shares."""
    own = np.add.reduce(line.weight * values, axis=1) / line.moments[:, 0]
    return np.abs(own / max(_middle_two(own), 0.5) - 1.0)


def _middle_two(values: Floats) -> float:
    """Returns the mean of the middle two of four."""
    _, low, high, _ = sorted(values.tolist())
    return 0.5 * (low + high)


def pulled_px2(pull: Floats, line: lines.LineFit, expected: lines.Edges) -> float:
    """Gives the mean square by which the ends of the edges move by the disagreement `pull` (4, n) of two estimators."""
    pulled = _pulled_lines(pull, line)
    pulled[:, 1] *= 0.5 * expected.length / expected.free
    return float(np.vdot(pulled, pulled)) / 4


def _pulled_lines(pull: Floats, line: lines.LineFit) -> Floats:
    """Returns offset and rise (4, 2) of the edges by the disagreement of two estimators.

    What all edges have in common is left out: a blur that is a little off, not uneven light.
    """
    pulled = lines.weighted(pull, line)
    pulled[:, 0] -= _middle_two(pulled[:, 0])
    return pulled


def out_of_shadow(
    pull: Floats, line: lines.LineFit, expected: lines.Edges, *, contrast: Matrix
) -> tuple[Points | None, Points, lines.LineFit]:
    """Reads edges beside an even margin on which a shadow's edge lies, by the estimator that does not mind it.

    Args:
        pull: (4, n) what that estimator adds to the points, px.
        line: the lines of the four edges.
        expected: where the edges are expected.
        contrast: (4, n) the points' contrast, of 255.

    Returns:
        How far the corners (4,) move by it, px (None without a shadow); how far two estimators disagree about them
        elsewhere; and the lines, with the larger scatter of the points so read.
    """
    pulled = _pulled_lines(pull, line)
    offset, rise = pulled[:, 0], pulled[:, 1]
    if not _light_differs(contrast, line.weight):
        return None, lines.intersect(expected, offset, rise) - expected.start, line
    rest = pull - lines.along(pulled, count=pull.shape[1])
    scatter = np.add.reduce(line.weight * rest * rest, axis=1)
    total = line.moments[:, 0]
    explained = offset * offset * total + rise * rise * line.moments[:, 2]
    shaded = explained * total > SHADED * scatter
    shaded &= total > WHOLE * pull.shape[1]
    if not shaded.any():
        return None, lines.intersect(expected, offset, rise) - expected.start, line
    moves = lines.intersect(expected, offset * shaded, rise * shaded) - expected.start
    left = lines.intersect(expected, offset * ~shaded, rise * ~shaded) - expected.start
    return moves, left, line._replace(residual=line.residual + shaded[:, None] * rest)


def _light_differs(contrast: Matrix, weight: Floats) -> bool:
    """Returns true if the halves of the edges are not in the same light."""
    halves = np.add.reduce((weight * contrast).reshape(8, -1), axis=1)
    light = halves / np.maximum(np.add.reduce(weight.reshape(8, -1), axis=1), 1.0)
    return float(light.min()) < (1.0 - IN_SHADOW) * float(light.max())


def margin_variance(line: lines.LineFit, *, profiles: Floats) -> Floats:
    """Returns the variance (4,), px², of the points of each edge beside an even margin.

    Few points that were chosen for agreeing with each other scatter less than those that they were chosen from: of an
    edge that is seen in part it is that of all edges, if that is larger. `profiles` (4,) is the number of profiles of
    each edge.
    """
    own = lines.point_variance(line)
    in_part = line.moments[:, 0] < IN_PART * profiles
    if not any(in_part.tolist()):
        return own
    return np.where(in_part, SEEN_IN_PART * np.maximum(own, float(np.add.reduce(own)) / 4), own)


def margin_sigma(pull: Points, scatter: Floats, *, contrast: float, path_px: float, uneven: bool) -> Sigmas:
    """Returns sigma beside an even margin.

    Two estimators of which one does not mind uneven light disagree by `pull` at the corners. But for noise they should
    agree: a shadow pulls the one in use further than that, at any corner, not just where they disagree. In `uneven`
    light there is a shadow, and what it pulls by less than the noise is not seen.

    Args:
        pull: (4,) how far the two estimators disagree at the corners, px.
        scatter: (4,) the variance of a corner's coordinate that the scatter of points tells, px².
        contrast: the mark's contrast, of 255.
        path_px: the mark's path within the exposure, px.
        uneven: True if the light is uneven.
    """
    excess = float(np.vdot(pull, pull).real) - PULL_NOISE**2 * float(np.add.reduce(scatter))
    shadow = SHADOW_SHARE**2 * max(excess, 0.0) / 4.0
    always = SYSTEMATIC_PX**2 + (ROUNDING_PX / contrast) ** 2 + (MOTION_BLUR * path_px) ** 2
    sigmas = _sigmas((HIDDEN * scatter if uneven else scatter) + (shadow + always))
    return sigmas._replace(pulled=excess > 0)


def _sigmas(variance: Floats) -> Sigmas:
    """Sums up the variances (4,) of a coordinate of each corner."""
    each = variance.tolist()
    return Sigmas(sqrt(sum(each) / 4), sqrt(max(each)))


def texture_sigma(
    pull: Floats,
    line: lines.LineFit,
    expected: lines.Edges,
    *,
    blur_off_px: Floats,
    blur_known: bool,
    contrast: float,
    path_px: float,
) -> Sigmas:
    """Returns sigma beside a textured plate.

    Texture along an edge moves many of its points alike, so their scatter tells too little. A blur that was found in
    this frame is that of its own edges, whose difference from it shows no error that they share.

    Args:
        pull: (4, n) how far two estimators disagree, px.
        line: the lines of the four edges.
        expected: where the edges are expected.
        blur_off_px: (4,) how much each edge's own blur differs from the one in use, px.
        blur_known: True if the blur is known from earlier frames.
        contrast: the mark's contrast, of 255.
        path_px: the mark's path within the exposure, px.
    """
    slow, own = _slow(line), lines.point_variance(line)
    points = (0.5 * TEXTURE_SLOW) * (slow + slow[_OPPOSITE]) + TEXTURE_SCATTER * float(np.add.reduce(own)) / 4
    in_part = line.moments[:, 0] < IN_PART * line.weight.shape[1]
    if any(in_part.tolist()):
        points = np.where(in_part, SEEN_IN_PART * np.maximum(points, own), points)
    blurred = TEXTURE_BLUR * float(np.vdot(blur_off_px, blur_off_px)) / 4
    if not blur_known:
        blurred += TEXTURE_BLUR_NOISE * float(np.add.reduce(own / line.moments[:, 0])) / 4
    rounded = (ROUNDING_ON_TEXTURE_PX / contrast) ** 2 / (1.0 + (contrast / NOISY) ** 2)
    always = SYSTEMATIC_ON_TEXTURE_PX**2 + rounded + (MOTION_BLUR_ON_TEXTURE * path_px) ** 2
    everywhere = TEXTURE_PULL * pulled_px2(pull, line, expected) + blurred + always
    corners, edges = lines.at_corners_and_edges(points, line, expected, everywhere=everywhere)
    return Sigmas(sqrt(sum(corners) / 4), sqrt(max(corners)), edges=edges)


def _slow(line: lines.LineFit) -> Floats:
    """Returns the power (4,) of what varies slowly along an edge, as the variance of one point that it is equal to."""
    parts = (line.weight * line.residual) @ _slow_waves(line.weight.shape[1])
    return np.add.reduce(parts * parts, axis=1) / (parts.shape[1] * line.moments[:, 0])


@lru_cache(maxsize=4)
def _slow_waves(count: int) -> Floats:
    """Returns Legendre polynomials (count, 4) of the degrees 2 to 5, of unit mean square."""
    degrees = np.arange(6)
    values = np.polynomial.legendre.legvander(2.0 * lines.places(count), 5) * np.sqrt(2 * degrees + 1)
    return np.asarray(values[:, 2:], dtype=np.float64)

"""A filter of the mark's shape over the places that it has passed: it moves, and turns, but does not change.

Beside a textured plate an edge is pulled by the texture under it, with motion blur by several times the noise. A few
pixels further on it is another texture. So the shape that was seen at earlier places, where it agrees with what is
seen, holds the corners together: of the eight numbers of four lines only three, place and turn, are new. At one place
the texture stays the same, and more frames of it teach nothing. A lens, or a camera that looks askew, changes the shape
from place to place; by how much is found out on the way.

Corners and edges are plain complex numbers, four at a time: faster than arrays.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking.lines import EdgeVariance
from pi_agent.tracking.motion import Four, Way, unsheared

Points = NDArray[np.complex128]

APART_PX = 3.0  # distance from which on another place's texture lies under the edges
LENS = 0.001  # change of the shape from place to place, in shares of the way, before any was seen
LEAST_LENS = 0.0003  # smallest such change: no lens is taken to be better
MOST_WAYS = 10.0  # number of ways from place to place whose change is remembered
OTHER_TEXTURE_PX = 1.0  # distance after which the edges lie in another texture, as far as they tell
WORSE = 1.3  # factor on the variance from which on a mark is seen worse than before
LEAST_NEW = 0.3  # smallest share of an edge's variance that is not its texture's
POSE = 0.5  # share of the edges' variances that moves the mark: light and blur move opposite edges apart
SAMPLING_PX = 0.01  # error with which a mark is seen again at its place
FARTHEST_PX = 80.0  # distance beyond which a place says nothing of the shape at another
MOST_DISAGREEMENTS = 10  # frames in a row that disagree with the shape, after which the mark has another
CHANGED = 2.0  # smallest change that counts at once, in variances of what is known and what is seen
SHAPES = 5.0  # numbers, of the eight of four lines, that are the shape
FREE = SHAPES / 8.0
AGREES = 30.0  # largest sum of their squared deviations for a shape that is the same


class Settled(NamedTuple):
    """Corners (4,) by shape and edges, where these agree, and what sigma is times: of all corners, and of the worst."""

    corners: Points
    mean_share: float
    worst_share: float
    agrees: bool = True


class _Match(NamedTuple):
    """The fit of a shape to what is seen: tangent and length of the edges, and how far those are to move out.

    `spread`: variances of edges and shape together; `towards`: shares of the way to the shape; `odds`: sum of the
    squared deviations.
    """

    edges: list[tuple[complex, float]]
    spread: EdgeVariance
    towards: EdgeVariance
    moves: EdgeVariance
    odds: float


class _Here(NamedTuple):
    """The facts of the present place: unsheared corners of `frames` frames, their variance, that by noise alone.

    `variance_factor`: by how much the variance is larger where the known shape disagrees.
    """

    corners: Four
    variance_px2: float
    noise_px2: float
    frames: int
    variance_factor: float


class ShapeFilter:
    """Learned from frame to frame, used from place to place. `line_s`: time from row to row."""

    def __init__(self, *, line_s: float) -> None:
        self._line_s = line_s
        self._shape: Four | None = None
        self._variance_px2 = 0.0
        self._lens2, self._ways = LENS * LENS, 1.0
        self._here: _Here | None = None
        self._variance_factor = 1.0
        self._disagreements = 0

    def recall(
        self, corners: Points, variance: EdgeVariance, *, sigma_px: float, way: Way, slack_px: float
    ) -> Settled | None:
        """Returns the corners (4,) of a mark seen worse than before at the same place, by how it was seen there.

        None where nothing better is known of this place. `sigma_px`: of the corners by their edges; `slack_px`: what
        the rolling shutter may make of the shape by a speed that is not steady.
        """
        here = self._here
        if here is None or sigma_px * sigma_px < WORSE * here.variance_px2:
            return None
        seen = unsheared(corners, way=way, line_s=self._line_s)
        moved = _way_px(here.corners, seen)
        if moved > OTHER_TEXTURE_PX:
            return None
        free = here.noise_px2 + here.variance_px2 * moved / OTHER_TEXTURE_PX + slack_px * slack_px
        # The texture under an edge is the same as before.
        u0, q0 = 0.5 * here.variance_px2, 2.0 * here.variance_px2
        anew = [(max(u - u0, LEAST_NEW * u), max(q - q0, LEAST_NEW * q)) for u, q in variance]
        match = _match(here.corners, seen, anew, free_px2=free)
        if match.odds > AGREES:
            return Settled(corners, *(2 * [sqrt(match.odds / SHAPES)]), agrees=False)
        placed = here.variance_px2 + POSE * _pose_px2(match)
        share = min(sqrt(placed) / sigma_px, 1.0)
        return Settled(corners + np.array(_corner_moves(match.edges, match.moves)), share, share)

    def settle(self, corners: Points, variance: EdgeVariance, *, way: Way, slack_px: float) -> Settled | None:
        """Returns the corners (4,) by their edges and the shape; None when it is not known.

        Where the shape disagrees, one of the two is wrong: the corners remain as they are, with a larger sigma.
        `slack_px`: what the rolling shutter may make of the shape by a speed that is not steady.
        """
        seen = unsheared(corners, way=way, line_s=self._line_s)
        self._leave(seen)
        shape, self._variance_factor = self._shape, 1.0
        way_px = 0.0 if shape is None else _way_px(shape, seen)
        if shape is None or way_px > FARTHEST_PX:
            return None
        free = self._variance_px2 + self._lens2 * way_px * way_px + slack_px * slack_px
        match = _match(shape, seen, variance, free_px2=free)
        if match.odds > AGREES:
            self._variance_factor = match.odds / SHAPES
            return Settled(corners, sqrt(self._variance_factor), sqrt(self._variance_factor), agrees=False)
        return Settled(corners + np.array(_corner_moves(match.edges, match.moves)), *_shares(variance, match.towards))

    def learn(self, corners: Points, *, sigma_px: float, noise_px: float, way: Way) -> None:
        """Takes the corners (4,) that the edges alone tell in the frame that was settled last, and their sigma.

        `noise_px`: the part of it that is another one in each frame of one place.
        """
        seen = unsheared(corners, way=way, line_s=self._line_s)
        self._leave(seen)
        self._disagreements = self._disagreements + 1 if self._variance_factor > 1.0 else 0
        if self._disagreements > MOST_DISAGREEMENTS:
            self._shape = None
        here = self._here
        if here is None:
            self._here = _Here(seen, sigma_px * sigma_px, noise_px * noise_px, 1, self._variance_factor)
            return
        frames = here.frames + 1
        laid = _onto(here.corners, seen)
        mean = [old + (new - old) / frames for old, new in zip(laid, seen, strict=True)]
        self._here = here._replace(corners=mean, noise_px2=max(noise_px**2 / frames, SAMPLING_PX**2), frames=frames)

    def _leave(self, seen: Four) -> None:
        """Adds the present place to what is known once the mark has left it."""
        here = self._here
        if here is not None and _way_px(here.corners, seen) > APART_PX:
            self._take(here)
            self._here = None

    def _take(self, here: _Here) -> None:
        shape, seen, noise = self._shape, here.corners, here.variance_px2
        way2 = 0.0 if shape is None else _way_px(shape, seen) ** 2
        if shape is None or way2 > FARTHEST_PX**2:
            self._shape, self._variance_px2 = seen, noise
            return
        laid = _onto(shape, seen)
        parted = sum(abs(new - old) ** 2 for old, new in zip(laid, seen, strict=True)) / (8.0 * FREE)
        change = (parted - noise - self._variance_px2) / way2
        expected = self._variance_px2 + self._lens2 * way2
        self._ways = min(self._ways + 1.0, MOST_WAYS)
        at_once = change * way2 > CHANGED * (noise + self._variance_px2)
        self._lens2 += (change - self._lens2) / (1.0 if at_once else self._ways)
        self._lens2 = max(self._lens2, LEAST_LENS**2)
        share = expected / (expected + here.variance_factor * noise)
        self._shape = [old + share * (new - old) for old, new in zip(laid, seen, strict=True)]
        self._variance_px2 = (1.0 - share) * expected


def _way_px(corners: Four, others: Four) -> float:
    """Returns the way that the corners have gone, by moving and turning."""
    return sum(abs(b - a) for a, b in zip(corners, others, strict=True)) / 4


def _match(shape: Four, seen: Four, variance: EdgeVariance, *, free_px2: float) -> _Match:
    """Matches the shape to the mark seen; `free_px2`: variance of a coordinate of the shape's corners."""
    edges = _edges(seen)
    spread = [(across + 0.5 * free_px2, turned + 2.0 * free_px2) for across, turned in variance]
    apart = _apart(edges, seen, _laid(shape, seen, edges=edges, spread=spread))
    odds = sum(a * a / v + b * b / w for (a, b), (v, w) in zip(apart, spread, strict=True))
    towards = [(u / v, q / w) for (u, q), (v, w) in zip(variance, spread, strict=True)]
    moves = [(a * x, b * y) for (a, b), (x, y) in zip(apart, towards, strict=True)]
    return _Match(edges, spread, towards, moves, odds)


def _pose_px2(match: _Match) -> float:
    """Returns the variance of a corner's coordinate by place and turn, as the edges tell them."""
    across = sum(1.0 / (1.0 / match.spread[k][0] + 1.0 / match.spread[k + 2][0]) for k in (0, 1))
    turned = sum(length * length / rise for (_, length), (_, rise) in zip(match.edges, match.spread, strict=True))
    return 0.5 * across + sum(length * length for _, length in match.edges) / 16.0 / turned


def _onto(shape: Four, seen: Four) -> Four:
    """Returns the shape, moved and turned to where it is seen."""
    centre, own = sum(seen) / 4, sum(shape) / 4
    turn = sum((a - own).conjugate() * (z - centre) for a, z in zip(shape, seen, strict=True))
    turn /= abs(turn)
    return [centre + turn * (a - own) for a in shape]


def _edges(corners: Four) -> list[tuple[complex, float]]:
    """Returns the tangent and length of each edge."""
    steps = [corners[k - 3] - corners[k] for k in range(4)]
    return [(step / abs(step), abs(step)) for step in steps]


def _apart(edges: list[tuple[complex, float]], seen: Four, shape: Four) -> list[tuple[float, float]]:
    """Gives the distances of the shape's edges outside those seen, at the middle, and how much they grow to the end."""
    gaps = [b - a for a, b in zip(seen, shape, strict=True)]
    apart = []
    for k, (tangent, _) in enumerate(edges):
        # Along the outward normal, −i times the tangent.
        first, last = -(tangent.conjugate() * gaps[k]).imag, -(tangent.conjugate() * gaps[k - 3]).imag
        apart.append((0.5 * (first + last), last - first))
    return apart


def _laid(shape: Four, seen: Four, *, edges: list[tuple[complex, float]], spread: list[tuple[float, float]]) -> Four:
    """Returns the shape where it fits the edges best, each by its worth (exact for a rectangle, which it nearly is)."""
    laid = _onto(shape, seen)
    apart = _apart(edges, seen, laid)
    centre, move = sum(laid) / 4, 0j
    for k in (0, 1):
        one, other = 1.0 / spread[k][0], 1.0 / spread[k + 2][0]
        move += -1j * edges[k][0] * ((other * apart[k + 2][0] - one * apart[k][0]) / (one + other))
    worth = [length / s for (_, length), (_, s) in zip(edges, spread, strict=True)]
    total = sum(w * length for w, (_, length) in zip(worth, edges, strict=True))
    turn = sum(w * rise for w, (_, rise) in zip(worth, apart, strict=True)) / total
    return [z + move + 1j * turn * (z - centre) for z in laid]


def _corner_moves(edges: list[tuple[complex, float]], moves: list[tuple[float, float]]) -> Four:
    """Returns the displacement of each corner when its two edges move out so far at the middle and rise so much."""
    corners = []
    for k in range(4):
        (tangent, _), (before, _) = edges[k], edges[k - 1]
        out, out_before = moves[k][0] - 0.5 * moves[k][1], moves[k - 1][0] + 0.5 * moves[k - 1][1]
        corners.append((out * before - out_before * tangent) / (before.conjugate() * tangent).imag)
    return corners


def _shares(variance: EdgeVariance, towards: list[tuple[float, float]]) -> tuple[float, float]:
    """Returns the factors by which the sigma of all corners, and that of the worst, shrinks."""
    before = [u + 0.25 * q for u, q in variance]
    after = [
        u * (1.0 - FREE * a) + 0.25 * q * (1.0 - FREE * b) for (u, q), (a, b) in zip(variance, towards, strict=True)
    ]
    worst = max(after[k] + after[k - 1] for k in range(4)) / max(before[k] + before[k - 1] for k in range(4))
    return sqrt(sum(after) / sum(before)), sqrt(worst)

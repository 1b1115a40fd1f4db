"""What the scatter of an edge's points does not show: uneven light along it, and the edge of something else."""

from math import ceil, hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking import lines

Floats = NDArray[np.float64]
Points = NDArray[np.complex128]

COMMON_SHARE = 0.15  # beside a textured plate: error that an edge's points have in common, in shares of their scatter
PULL_SHARE = 0.2  # and in shares of what the texture does to an estimator that minds it less
PULL_NOISE = 0.8  # disagreement by noise, in shares of the scatter
SHADOW_SHARE = 3.5  # beside an even margin: error by a shadow along an edge, in shares of the disagreement
SYSTEMATIC_PX = 0.004  # left over from sampling and from a blur that is not quite Gaussian
AGREES = 0.3  # weight from which a profile agrees with its line
BENT = 5, 6.0  # neighbouring profiles, and the length of edge (px), that disagree alike by no chance
BENT_END_PX = 0.1  # an edge whose last three profiles all lie so far beside its line has another one's direction
BENT_LEAST_PX = 0.06  # what a profile must lie beside its line to count as another edge's
_ENDS = np.array([[0, 1, 2], [-1, -2, -3]])


def bent(line: lines.LineFit, believed: Floats, *, shortest_px: float) -> bool:
    """Whether neighbours on an edge all show an edge on the same side of its line: two edges, and one is not its."""
    beside_line = line.weight < AGREES
    if np.add.reduce(beside_line, axis=1).max() < _ENDS.shape[1]:
        return False
    profiles, length_px = BENT
    run = max(profiles, ceil(line.weight.shape[1] * length_px / shortest_px))
    if run >= line.weight.shape[1]:
        return False
    # Beside a sharp edge a compressed video's blocks disagree by hundredths of a pixel, which harms nobody.
    disagree = (believed > 0) & beside_line & (np.abs(line.residual) > BENT_LEAST_PX)
    at_ends = line.residual[:, _ENDS] * disagree[:, _ENDS]
    if max(at_ends.min(axis=2).max(), -at_ends.max(axis=2).min()) > BENT_END_PX:
        return True
    beside = np.sign(line.residual) * disagree
    total = np.add.accumulate(beside, axis=1)
    return bool(np.abs(total[:, run:] - total[:, :-run]).max() >= run)


def corner_pull(pull: Floats, line: lines.LineFit, expected: lines.Edges) -> Points:
    """The expected corners (4,) moved by the disagreement `pull` (4, n) of two estimators on each edge.

    What all edges have in common is left out: a blur that is a little off, not uneven light.
    """
    offset, rise = lines.weighted(pull, line.weight)
    _, low, high, _ = np.sort(offset)  # np.median takes ten times as long
    return lines.intersect(expected, offset - 0.5 * (low + high), rise)


def common_px(pull: Floats, scatter_px: float, residual_px: float, *, even: bool) -> float:
    """The error that the points of an edge have in common, which their scatter does not show, by what they do show.

    Two estimators that mind uneven light unlike each other disagree by `pull` (4,) at the corners. Beside an even
    margin, where they should agree but for noise, a shadow along the edge pulls the one in use further than that.
    """
    if not even:
        return hypot(COMMON_SHARE * residual_px, PULL_SHARE * sqrt(float(np.vdot(pull, pull)) / 4))
    excess = np.maximum(pull * pull - (PULL_NOISE * scatter_px) ** 2, 0.0)
    return hypot(SYSTEMATIC_PX, SHADOW_SHARE * sqrt(float(excess.sum()) / 4))

"""What the scatter of an edge's points does not show: uneven light along it, and the edge of something else."""

from functools import lru_cache
from math import ceil, hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking import lines

Floats = NDArray[np.float64]
Points = NDArray[np.complex128]

# Beside a textured plate: the variance of an edge's ends by what varies slowly along it, by the disagreement of two
# estimators that mind texture unlike each other, and by a blur that is not the other edges'; and what is always left.
GRAIN_SLOW, GRAIN_PULL, GRAIN_BLUR, GRAIN_PX = 0.95, 0.11, 0.65, 0.006
PULL_NOISE = 0.8  # disagreement by noise, in shares of the scatter
SHADOW_SHARE = 3.5  # beside an even margin: error by a shadow along an edge, in shares of the disagreement
SYSTEMATIC_PX = 0.004  # left over from sampling and from a blur that is not quite Gaussian
AGREES = 0.3  # weight from which a profile agrees with its line
BENT = 5, 6.0  # neighbouring profiles, and the length of edge (px), that disagree alike by no chance
BENT_END_PX = 0.1  # an edge whose last three profiles all lie so far beside its line has another one's direction
BENT_LEAST_PX = 0.06  # what a profile must lie beside its line to count as another edge's
_OPPOSITE = np.array([2, 3, 0, 1])
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
    """How far the corners (4,) move by the disagreement `pull` (4, n) of two estimators on each edge.

    What all edges have in common is left out: a blur that is a little off, not uneven light.
    """
    offset, rise = lines.weighted(pull, line.weight)
    _, low, high, _ = np.sort(offset)  # np.median takes ten times as long
    return lines.intersect(expected, offset - 0.5 * (low + high), rise) - expected.start


def margin_sigma(pull: Points, scatter_px: float) -> float:
    """Sigma of a corner's coordinate beside an even margin, by what the scatter of an edge's points does not show.

    Two estimators that mind uneven light unlike each other disagree by `pull` (4,) at the corners. Here they should
    agree but for noise: a shadow along the edge pulls the one in use further than that.
    """
    excess = np.maximum(pull.real**2 + pull.imag**2 - (PULL_NOISE * scatter_px) ** 2, 0.0)
    return hypot(scatter_px, SYSTEMATIC_PX, SHADOW_SHARE * sqrt(float(np.add.reduce(excess)) / 4))


def grain_sigma(
    pull: Points, line: lines.LineFit, expected: lines.Edges, *, blur_off_px: Floats
) -> tuple[float, float]:
    """Sigma of a corner's coordinate beside a textured plate, of all corners and of the worst.

    Grain that runs along an edge moves many of its points alike, so their scatter tells too little. `blur_off_px`: (4,)
    how much each edge's own blur differs from the one in use.
    """
    slow = _slow(line)
    slow = np.maximum(0.5 * (slow + slow[_OPPOSITE]), lines.point_variance(line).mean())
    normal = 1j * np.conj(expected.tangent)
    start, end = (pull * normal).real, (pull[lines.NEXT] * normal).real
    pulled = 0.5 * (start * start + end * end)
    blurred = 0.5 * (blur_off_px**2 + blur_off_px[_OPPOSITE] ** 2)
    variance = GRAIN_SLOW * slow * lines.end_variance(line, expected)
    variance += GRAIN_BLUR * blurred + GRAIN_PULL * pulled + GRAIN_PX**2
    worst = float((variance + variance[lines.BEFORE]).max())
    return sqrt(float(np.add.reduce(variance)) / 4), sqrt(0.5 * worst)


def _slow(line: lines.LineFit) -> Floats:
    """Power (4,) of what varies slowly along an edge, as the variance of one point that it is equal to."""
    parts = (line.weight * line.residual) @ _slow_waves(line.weight.shape[1])
    return np.add.reduce(parts * parts, axis=1) / (parts.shape[1] * line.moments[:, 0])


@lru_cache(maxsize=4)
def _slow_waves(count: int) -> Floats:
    """Legendre polynomials (count, 4) of the degrees 2 to 5, of unit mean square."""
    degrees = np.arange(6)
    values = np.polynomial.legendre.legvander(2.0 * lines.places(count), 5) * np.sqrt(2 * degrees + 1)
    return np.asarray(values[:, 2:], dtype=np.float64)

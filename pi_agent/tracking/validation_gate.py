"""The validation gate: decides if a fit can be the mark, lying flat, before its corners are used."""

from dataclasses import dataclass
from math import acos, degrees, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking.config import TrackerConfig
from pi_agent.tracking.motion import Four, Way, unsheared
from pi_agent.tracking.refine import Fit

Points = NDArray[np.complex128]
Shape = tuple[float, float, float]

LEAST_MEAN_AGREEMENT = 0.55
LEAST_AGREEMENT = 0.4, 0.27  # share of each edge's profiles: in acquisition, and once the mark's shape is known


class Demand(NamedTuple):
    """The largest sigma (px) of the worst corner in dim and in bright light, of a partly covered and a moving mark.

    The limit of a moving one holds while its shape is not known yet, so that nothing else speaks for it.
    """

    dim_sigma_px: float
    bright_sigma_px: float
    partly_sigma_px: float
    moving_sigma_px: float

    def limit_px(self, fit: Fit) -> float:
        """Returns the largest sigma of the worst corner."""
        share = min(DIM / fit.contrast, 1.0)
        limit = self.bright_sigma_px + (self.dim_sigma_px - self.bright_sigma_px) * share
        if fit.whole <= WHOLE:
            limit = min(limit, self.partly_sigma_px)
        if fit.path_px > MOTION_BLUR_PX and fit.alone is None:
            limit = min(limit, self.moving_sigma_px)
        # Edges that pass by themselves do not fail for agreeing with how they were seen before.
        badly_seen = fit.recalled and fit.by_edges.worst_px > max(limit, self.partly_sigma_px)
        return min(limit, RECALLED_PX) if badly_seen else limit


DIM = 16.0  # contrast (of 255) below which the light is called dim
WHOLE = 0.85  # share of its profiles that agree from which an edge is called whole
RECALLED_PX = 0.031  # largest sigma where badly seen edges follow how they were seen before: errors are not Gaussian
MOTION_BLUR_PX = 0.9  # path within the exposure that shows in the blur, and lays other texture under an edge
BESIDE_MARGIN = Demand(0.042, 0.045, 0.04, 0.045)  # even surfaces: anything else at the edge is a disturbance
BESIDE_PLATE = Demand(0.037, 0.055, 0.04, 0.035)  # texture disturbs every frame; noise beside it leaves less room
SHAPE_FIRST = 0.04  # relative departure from the mark's shape (cut askew, tilted camera) that acquisition allows
ROLLED = 0.03  # further departure that a rolling shutter may cause at a speed that is not known yet
CONVERGENCE = 0.02  # relative convergence of opposite sides that a lens may cause
PERSPECTIVE = 1.0 / 1200.0  # one over the shortest focal length (px) of a camera that looks at a plate
LONGER = 0.04  # change of a leaning mark's longer stretch, by which no perspective lengthens it
TIPPED = 0.02  # foreshortening that is called tipping: a lean of 11°


@dataclass(frozen=True)
class Verdict:
    """The gate's answer on a fit: `reason` says why it is refused, and is empty when it passes.

    `tip_rad`: lean by foreshortening; `rough`: the mark is there, but its edges are not known exactly enough.
    """

    reason: str = ""
    tip_rad: float = 0.0
    rough: bool = False


def verdict_on(fit: Fit, *, config: TrackerConfig, shape: Shape | None, way: Way) -> Verdict:
    """Returns the verdict on a fit.

    `shape`: the mark when it lay flat (see `flat_shape`), None in acquisition; `way`: its motion, by which a rolling
    shutter makes it another shape.
    """
    at_once = unsheared(fit.by_edges.corners, way=way, line_s=config.shutter.line_s)
    sides = side_vectors(at_once, aspect=config.mark.aspect)
    reason = _pixels_reason(fit, first=shape is None) or _size_reason(sides, config)
    if not reason and shape is None:
        reason = _first_shape_reason(fit, sides, config)
    verdict = (
        Verdict(reason)
        if reason or shape is None
        else _lying(sides, shape, unsteady=way.unsteady_px_s * config.shutter.line_s)
    )
    if not verdict.reason and fit.astray:
        return Verdict("outline not found: an edge lies elsewhere than where it was looked for")
    if not verdict.reason and not fit.worst_px < _demand(config).limit_px(fit):
        return Verdict(f"edges too uncertain: sigma {fit.worst_px:.2f} px", rough=True)
    return verdict


def _first_shape_reason(fit: Fit, sides: tuple[complex, complex], config: TrackerConfig) -> str:
    ideal = foreshortening(sides, None)
    if ideal < 1.0 - _allowed(config):
        return f"not the mark's shape: {_lean(ideal)}"
    if _askew(fit.by_edges.corners, stretch=ideal):
        return "not the mark's shape: its sides converge as no camera makes them"
    return ""


def _lying(sides: tuple[complex, complex], shape: Shape, *, unsteady: float) -> Verdict:
    """Returns the verdict on a mark of known shape, flat or leaning.

    `unsteady` is the shear by a speed that may be wrong.
    """
    flat = 1.0 - TIPPED - unsteady
    # A mark that was first seen leaning, and one that was cut askew, are each told by one of the two comparisons.
    stretch = foreshortening(sides, None)
    if stretch < flat:
        stretch = max(stretch, foreshortening(sides, shape))
    if stretch >= flat:
        return Verdict()
    if abs(stretches(sides, shape)[1] - 1.0) > LONGER:
        return Verdict("outline changed: longer or shorter than any lean makes it, so covered or in uneven light")
    return Verdict(f"tipping: {_lean(stretch)}", acos(stretch))


def _askew(corners: Points, *, stretch: float) -> bool:
    """Returns true if opposite sides converge by more than the lean explains that foreshortening tells.

    Then one of the edges is not the mark's.
    """
    a, b, c, d = corners.tolist()
    diagonal = abs(c - a)
    lean = sqrt(max(1.0 - stretch * stretch, 0.0))
    return abs(a - b + c - d) > (CONVERGENCE + PERSPECTIVE * lean * diagonal) * diagonal


def _allowed(config: TrackerConfig) -> float:
    """Returns the relative departure from the mark's shape that acquisition allows."""
    return SHAPE_FIRST + (ROLLED if config.shutter.line_ns else 0.0)


def _lean(stretch: float) -> str:
    return f"foreshortened by {100 * (1 - stretch):.1f} %, a lean of {degrees(acos(stretch)):.0f} deg"


def _demand(config: TrackerConfig) -> Demand:
    return BESIDE_PLATE if config.mark.margin <= 0 else BESIDE_MARGIN


def _pixels_reason(fit: Fit, *, first: bool) -> str:
    if fit.saturated > 0.3:
        return "saturated: the light around the mark is beyond the sensor's range"
    share = fit.agreement.tolist()
    if min(share) < LEAST_AGREEMENT[0 if first else 1] or sum(share) < 4 * LEAST_MEAN_AGREEMENT:
        return "outline broken: covered, in glare or beside something dark"
    if first and fit.goes_on:
        return "outline broken: the dark goes on beyond a corner, so an edge is covered"
    if fit.bent:
        return "outline bent: the edge of something else lies along it"
    return ""


def _size_reason(sides: tuple[complex, complex], config: TrackerConfig) -> str:
    side = sqrt(abs((sides[0].conjugate() * sides[1]).imag))
    low, high = config.side_px
    wanted = f"{low:.0f} to {high:.0f}"
    return "" if 0.9 * low <= side <= 1.1 * high else f"wrong size: {side:.0f} px where {wanted} are expected"


def side_vectors(corners: Four, *, aspect: float) -> tuple[complex, complex]:
    """Returns the mean first and second side as vectors (the second divided by the aspect), of corners at one time."""
    a, b, c, d = corners
    return 0.5 * (b + c - a - d), 0.5 * (d + c - a - b) / aspect


def flat_shape(sides: tuple[complex, complex]) -> Shape:
    """Returns the invariants under yaw: squared length of the first side, of the second, and their product."""
    right, down = sides
    return abs(right) ** 2, abs(down) ** 2, (right.conjugate() * down).real


def foreshortening(sides: tuple[complex, complex], shape: Shape | None) -> float:
    """Returns the ratio (0…1, 1 = flat) of the smaller to the larger stretch of the mark against its flat shape."""
    short, long = stretches(sides, shape)
    return short / long


def stretches(sides: tuple[complex, complex], shape: Shape | None) -> tuple[float, float]:
    """Returns the smaller and the larger stretch of the mark against its flat shape (None: the unit square).

    Their squares are the eigenvalues of (flat Gram matrix)⁻¹ (Gram matrix seen).
    """
    p, q, r = flat_shape(sides)
    p0, q0, r0 = shape or (1.0, 1.0, 0.0)
    flat_area = p0 * q0 - r0 * r0
    half = 0.5 * (q0 * p + p0 * q - 2.0 * r0 * r) / flat_area
    area = max(p * q - r * r, 0.0) / flat_area
    root = sqrt(max(half * half - area, 0.0))
    return sqrt(max(half - root, 0.0)), sqrt(half + root)

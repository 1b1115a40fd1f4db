"""Whether what was fitted can be the mark, lying flat: the last word before corners are believed."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking.config import TrackerConfig
from pi_agent.tracking.refine import Fit

Floats = NDArray[np.float64]

LEAST_AGREEMENT = 0.45  # of every edge's profiles
LEAST_MEAN_AGREEMENT = 0.62
LARGEST_SIGMA_PX = 0.25
SHAPE_FIRST = 0.06  # relative departure from the mark's shape that is allowed at first sight
TIPPED = 0.02  # foreshortening that is called tipping: a lean of 11°


@dataclass(frozen=True)
class Verdict:
    """`reason` is empty when the fit is believed; `tip_rad`: lean told by foreshortening."""

    reason: str = ""
    tip_rad: float = 0.0


def judge(fit: Fit, *, config: TrackerConfig, shape: Floats | None, shear: float) -> Verdict:
    """The verdict on a fit.

    `shape`: (2, 2) Gram matrix's square root of the sides of the mark when it lay flat, None at first sight; `shear`:
    the horizontal shift per row that the rolling shutter causes at the present speed.
    """
    reason = _pixels_reason(fit) or _size_reason(fit, config)
    if reason:
        return Verdict(reason)
    stretch = foreshortening(fit.corners, aspect=config.mark.aspect, shear=shear, shape=shape)
    limit = SHAPE_FIRST if shape is None else TIPPED
    if stretch < 1.0 - limit:
        tip = float(np.arccos(min(stretch, 1.0)))
        kind = "not the mark's shape" if shape is None else "tipping"
        return Verdict(
            f"{kind}: foreshortened by {100 * (1 - stretch):.1f} %, a lean of {np.degrees(tip):.0f} deg", tip
        )
    return Verdict()


def _pixels_reason(fit: Fit) -> str:
    if fit.saturated > 0.3:
        return "saturated: the light around the mark is beyond the sensor's range"
    if fit.agreement.min() < LEAST_AGREEMENT or fit.agreement.mean() < LEAST_MEAN_AGREEMENT:
        return "outline broken: covered, in glare or beside something dark"
    if not fit.sigma_px < LARGEST_SIGMA_PX:
        return f"edges too uncertain: sigma {fit.sigma_px:.2f} px"
    return ""


def _size_reason(fit: Fit, config: TrackerConfig) -> str:
    sides = np.linalg.norm(np.roll(fit.corners, -1, axis=0) - fit.corners, axis=1)
    area = float(sides[0] + sides[2]) * float(sides[1] + sides[3]) / 4
    side = float(np.sqrt(area / config.mark.aspect))
    low, high = config.side_px
    return (
        ""
        if 0.9 * low <= side <= 1.1 * high
        else f"wrong size: {side:.0f} px where {low:.0f} to {high:.0f} are expected"
    )


def sides_matrix(corners: Floats, *, aspect: float, shear: float) -> Floats:
    """The affine map (2, 2) from the unit mark to the image, with the rolling shutter's shear taken out."""
    right = 0.5 * (corners[1] + corners[2] - corners[0] - corners[3])
    down = 0.5 * (corners[3] + corners[2] - corners[0] - corners[1]) / aspect
    matrix = np.stack([right, down], axis=1)
    matrix[0] -= shear * matrix[1]
    return matrix


def foreshortening(corners: Floats, *, aspect: float, shear: float, shape: Floats | None) -> float:
    """Ratio of the smaller to the larger stretch (1 = flat) of the quadrilateral against its flat shape."""
    matrix = sides_matrix(corners, aspect=aspect, shear=shear)
    if shape is not None:
        matrix = matrix @ np.linalg.inv(shape)
    (a, b), (c, d) = matrix
    total, area = a * a + b * b + c * c + d * d, abs(a * d - b * c)
    root = np.sqrt(max(total * total - 4 * area * area, 0.0))
    return float(np.sqrt((total - root) / (total + root)))

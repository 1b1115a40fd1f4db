"""From a rough quadrilateral to its exact corners: search if needed, then passes of profiles and lines."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking import edges, lines
from pi_agent.tracking.pixels import PixelReader

Floats = NDArray[np.float64]

PROFILES = 32  # a fine pass reads so many on each edge
SEARCHED = 14  # a search reads so many
LIMIT_MISFIT = 0.16  # a profile that departs from a step by more than this share of the contrast is no edge
LEAST_CONTRAST = 6.0  # of 255, in linear light: dim scenes have little more
FLOOR_PX = 0.012  # scatter of the edge points that is always believed


@dataclass(frozen=True)
class Fit:
    """The refined quadrilateral: corners (4, 2), one coordinate's sigma, RMS of the edge points; share of the profiles
    of each edge that agree (4,), the mark's contrast, the blur of each edge (4,) and the share of saturated profiles.
    """

    corners: Floats
    sigma_px: float
    residual_px: float
    agreement: Floats
    contrast: float
    blur_px: Floats
    saturated: float


def search_edges(reader: PixelReader, corners: Floats, *, reach_px: int) -> Floats | None:
    """Corners (4, 2) to within about half a pixel from ones that are up to `reach_px` off; None without edges."""
    frames = lines.edge_frames(corners)
    along = edges.places(frames, count=SEARCHED, clear_px=0.08 * float(frames.length.min()))
    offset, strength = edges.search(reader, frames, along, reach_px=reach_px)
    typical = np.sort(strength.ravel())[strength.size // 2]
    if typical < LEAST_CONTRAST:
        return None
    weight = np.clip(strength / typical, 0.0, 1.0) * (strength > 0.4 * typical)
    middle, slope = lines.vote(offset, along, weight, tolerance=1.5)
    fit = lines.fit_lines(offset, along, weight, start=(middle, slope), floor_px=0.5, rounds=2)
    return lines.intersect(frames, fit.offset, fit.slope)


def refine(
    reader: PixelReader, corners: Floats, *, blur_px: Floats, passes: int, vote_first: bool, left_out: Floats | None
) -> Fit | None:
    """The exact corners from ones that are within about a pixel; None when there is no mark.

    `blur_px`: (4,) expected blur of the edges; `left_out`: (4, 2) part of each edge (from, to in sides) that is known to
    be no edge, a notch.
    """
    blur = np.clip(blur_px, 0.55, 4.0)
    fit: Fit | None = None
    for number in range(passes):
        fit = _one_pass(reader, corners, blur, robust=vote_first and number == 0, left_out=left_out)
        if fit is None:
            return None
        corners, blur = fit.corners, fit.blur_px
    return fit


def _one_pass(
    reader: PixelReader, corners: Floats, blur: Floats, *, robust: bool, left_out: Floats | None
) -> Fit | None:
    frames = lines.edge_frames(corners)
    if frames.length.min() < 8.0:
        return None
    along = edges.places(frames, count=PROFILES, clear_px=1.0 + 3.2 * float(blur.max()))
    found = edges.measure(reader, frames, along, blur_px=blur)
    typical = float(np.sort(found.contrast.ravel())[found.contrast.size // 2])
    if typical < LEAST_CONTRAST:
        return None
    weight = _believed(found, typical, blur)
    if left_out is not None:
        place = along / frames.length[:, None] + 0.5
        weight = weight * ((place < left_out[:, :1]) | (place > left_out[:, 1:]))
    if np.count_nonzero(weight, axis=1).min() < PROFILES // 4:
        return None
    start = _start(found.offset, along, weight, robust=robust)
    fit = lines.fit_lines(found.offset, along, weight, start=start, floor_px=FLOOR_PX)
    total = fit.weight.sum()
    if fit.weight.sum(axis=1).min() < PROFILES / 6:
        return None
    change = np.sum(fit.weight * found.blur_error, axis=1) / fit.weight.sum(axis=1)
    return Fit(
        corners=lines.intersect(frames, fit.offset, fit.slope),
        sigma_px=lines.corner_sigma(fit, along, frames.length),
        residual_px=float(np.sqrt(np.sum(fit.weight * fit.residual**2) / total)),
        agreement=np.count_nonzero(fit.weight > 0.3, axis=1) / PROFILES,
        contrast=typical,
        blur_px=np.clip(blur * (1.0 + np.clip(change, -0.3, 0.3)), 0.55, 4.0),
        saturated=float(found.saturated.mean()),
    )


def _believed(found: edges.Profiles, typical: float, blur: Floats) -> Floats:
    """Weight 1 of profiles that look like the mark's edge, else 0 (4, n)."""
    good = (found.contrast > 0.4 * typical) & (found.contrast < 2.5 * typical) & ~found.saturated
    good &= found.misfit < LIMIT_MISFIT * typical + 2.0
    good &= np.abs(found.offset) < 2.5 * blur[:, None]
    return good.astype(np.float64)


def _start(offset: Floats, along: Floats, weight: Floats, *, robust: bool) -> tuple[Floats, Floats]:
    """Lines to start from: the vote of every second profile, or the weighted means."""
    if robust:
        return lines.vote(offset[:, ::2], along[:, ::2], weight[:, ::2], tolerance=0.4)
    total = weight.sum(axis=1)
    return (weight * offset).sum(axis=1) / total, np.zeros(4)

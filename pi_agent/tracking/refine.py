"""Refines a rough quadrilateral to its exact corners: a search if needed, then passes of profiles and lines."""

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking import covariance_model, edges, lines, profile_weights
from pi_agent.tracking.motion_blur import MotionBlur
from pi_agent.tracking.passes import (
    BLUR_RANGE_PX,
    LEAST_CONTRAST,
    PROFILES,
    Look,
    Step,
    Task,
    look_at,
    one_pass,
    within,
)
from pi_agent.tracking.pixels import PixelReader

Floats = NDArray[np.float64]
Points = NDArray[np.complex128]

SEARCHED = 14  # number of profiles that a search reads on each edge
SETTLED = 0.5, 0.05  # corrections of place and of blur, in shares of the blur, that need no further pass
SETTLED_BESIDE_MARGIN = 1.2, 0.05  # the same where the estimator leans on neither side
FOUND = 0.04, 0.001  # the same while the blur is being found, or is not the lens's alone
BLUR_ERROR = 0.0055  # relative error of a blur that all profiles show; it grows as 1 / the share of those that do
LEAST_TELLING = 0.01  # share of the profiles below which none shows the blur
DARK_BEYOND = 0.1, 1.5  # smaller rises from an edge's dark outwards, in contrasts and shares of the dark, are none
BLUR_ALIKE = 0.12  # edges whose blurs differ by less have one in common: the lens's
_LAST = np.array([0, 1, -2, -1])


class Fit(NamedTuple):
    """The refined quadrilateral.

    Attributes:
        corners: (4,) the corners x + i y, px.
        sigma_px: sigma of one coordinate, over all corners.
        worst_px: the same of the worst corner.
        residual_px: RMS distance of the edge points from their lines.
        agreement: (4,) share of each edge's readable profiles that agree with its line.
        contrast: step of the light across the edges, of 255.
        blur_px: (4,) blur of each edge.
        saturated: share of the profiles that are saturated.
        bent: True if neighbouring profiles show another edge beside their line.
        whole: least share of an edge's profiles that agree, readable or not.
        pulled: True if uneven light moves an edge.
        path_px: the mark's path within the exposure that was allowed for.
        edges: the variances of the lines.
        alone: the fit by the edges alone, where the known shape has a part in this one.
        recalled: True if badly seen edges follow how they were seen before.
        goes_on: True if the dark goes on beyond an edge's ends.
        astray: True if the last pass still moved a corner far: an edge lies elsewhere than it was looked for.
    """

    corners: Points
    sigma_px: float
    worst_px: float
    residual_px: float
    agreement: Floats
    contrast: float
    blur_px: Floats
    saturated: float
    bent: bool
    whole: float
    pulled: bool = False
    path_px: float = 0.0
    edges: lines.EdgeVariance | None = None
    alone: "Fit | None" = None
    recalled: bool = False
    goes_on: bool = False
    astray: bool = False

    @property
    def by_edges(self) -> "Fit":
        """The fit by the edges alone."""
        return self if self.alone is None else self.alone


def search_edges(reader: PixelReader, corners: Points, *, reach_px: int) -> Points | None:
    """Returns corners (4,), px, to about half a pixel, from `corners` (4,), px, up to `reach_px` off.

    It is None without edges.
    """
    expected = lines.expected_edges(corners, clear_px=0.08 * float(np.abs(corners[1] - corners[0])))
    offset, strength = edges.search(reader, expected, count=SEARCHED, reach_px=reach_px)
    typical = float(np.sort(strength.ravel())[strength.size // 2])
    if typical < LEAST_CONTRAST:
        return None
    weight = np.clip(strength / typical, 0.0, 1.0) * (strength > 0.4 * typical)
    start = lines.vote(offset, weight, tolerance=1.5, largest_rise=0.3 * expected.free)
    fit = lines.fit_lines(offset, weight, start=start, floor_px=0.5, rounds=2)
    return lines.intersect(expected, fit.offset, fit.rise)


def refine(
    reader: PixelReader,
    corners: Points,
    *,
    blur_px: Floats,
    task: Task,
    most_passes: int,
    blur_known: bool = False,
    motion_blur: MotionBlur | None = None,
    turn_per_row_rad: float = 0.0,
) -> Fit | None:
    """Returns the exact corners from ones that are within about a pixel; None when there is no mark.

    When the blur is not known, all edges are fitted with blurs of their own first, then with the one that they share,
    if they do. It ends when a pass has changed little.

    Args:
        reader: the frame's light.
        corners: (4,) where the corners are expected, px.
        blur_px: (4,) the expected blur of the edges, px; with `motion_blur` that of the lens.
        task: what kind of mark is to be read.
        most_passes: the largest number of passes.
        blur_known: True if the blur is known from earlier frames.
        motion_blur: that of the edges; None for a mark at rest.
        turn_per_row_rad: the mark's turn from one row's exposure to the next one's.
    """
    blur = within(blur_px, *BLUR_RANGE_PX)
    known = blur_known or motion_blur is not None
    still = SETTLED_BESIDE_MARGIN if task.even else SETTLED
    limit = still if blur_known else FOUND
    contrast = np.inf
    for left in range(most_passes - 1, -1, -1):
        model = task.estimator(known_blur=known, contrast=contrast)
        look = look_at(corners, blur, model=model, task=task, motion_blur=motion_blur)
        step = one_pass(
            reader, look, task=task, shared_blur=known, motion_blur=motion_blur, turn_per_row_rad=turn_per_row_rad
        )
        if step is None:
            return None
        contrast = step.contrast
        blur_right = step.blur_change < limit[1]
        settled = blur_right and step.moved < limit[0] and task.estimator(known_blur=known, contrast=contrast) is model
        corners, blur = step.corners, blur if blur_known and blur_right else step.blur_px
        if not known and float(blur.max()) < (1.0 + BLUR_ALIKE) * float(blur.min()):
            blur, known, settled = np.full(4, blur.mean()), True, False
        if settled or left == 0:
            blur_error_px = np.minimum(look.blur - blur_px, 0.0) if blur_known else _blur_error_px(step, look)
            path_px = 0.0 if motion_blur is None else abs(motion_blur.path_px)
            fit = _fit(step, look, even=task.even, path_px=path_px, blur_error_px=blur_error_px, blur_known=blur_known)
            fit = fit._replace(astray=True) if step.moved > still[0] else fit
            # An edge that is further away seems to lie in uneven light although it does not.
            if left == 0 or not fit.pulled or step.moved < SETTLED[0]:
                return fit
    return None


def _bent(step: Step, look: Look, *, even: bool) -> bool:
    shortest_px, width_px = min(look.expected.free.tolist()), np.zeros(4) if even else look.blur + look.path
    return covariance_model.bent(step.line, step.profile_weight, shortest_px=shortest_px, texture_px=width_px)


def _goes_on(step: Step) -> bool:
    """Returns true if it is as dark outside the last profiles of an edge as inside.

    What was fitted there covers the mark.
    """
    dark, outside = step.found.dark[:, _LAST], step.found.light[:, _LAST, -1]
    alike = DARK_BEYOND[0] * step.contrast
    none = (outside - dark < alike) & (outside < DARK_BEYOND[1] * dark)
    none &= dark < float(np.median(step.found.dark)) + alike  # not where something bright covers both
    return bool(none.any())


def _whole(step: Step, agreeing: NDArray[np.intp]) -> float:
    """Returns the least share of an edge's profiles that agree and lie in no highlight.

    `agreeing` (4,) is how many agree.
    """
    if step.found.glowing is not None:
        agreeing = np.add.reduce((step.line.weight > covariance_model.AGREES) & ~step.found.glowing, axis=1)
    return min(agreeing.tolist()) / PROFILES


def _blur_error_px(step: Step, look: Look) -> Floats:
    """Returns the error (4,) of a blur that was found in this frame alone, beyond that of one from a whole outline."""
    return (BLUR_ERROR * (1.0 / max(step.telling, LEAST_TELLING) - 1.0)) * look.blur


def _fit(step: Step, look: Look, *, even: bool, path_px: float, blur_error_px: Floats, blur_known: bool) -> Fit:
    """Returns the fit of the last pass with its errors and what speaks against it.

    `blur_error_px`: (4,) how much sharper (below 0) the edges seem than the lens was, for uneven light can do that; or
    how wrong the blur may be that the few profiles show on which no highlight lies.
    """
    found, line, expected, contrast = step.found, step.line, look.expected, step.contrast
    moves: Points | None = None
    if even:
        moves, pull, line = covariance_model.out_of_shadow(step.pull, line, expected, contrast=found.contrast)
        scatter = lines.scatter_variance(
            line, expected, variance=covariance_model.margin_variance(line, profiles=step.profiles)
        )
        sigma = covariance_model.margin_sigma(pull, scatter, contrast=contrast, path_px=path_px, uneven=step.uneven)
    else:
        off_px = step.wider * look.blur * look.sharp + blur_error_px
        sigma = covariance_model.texture_sigma(
            step.pull,
            line,
            expected,
            blur_off_px=off_px,
            blur_known=blur_known,
            contrast=contrast,
            path_px=path_px,
        )
    agreeing = np.add.reduce(line.weight > covariance_model.AGREES, axis=1)
    return Fit(
        corners=step.corners if moves is None else step.corners + moves,
        sigma_px=sigma.mean_px,
        worst_px=sigma.worst_px,
        residual_px=sqrt(float(np.vdot(line.weight, line.residual * line.residual)) / sum(line.moments[:, 0].tolist())),
        agreement=agreeing / profile_weights.readable(found),
        whole=_whole(step, agreeing),
        contrast=step.contrast,
        blur_px=step.blur_px,
        saturated=0.0 if found.saturated is None else float(found.saturated.mean()),
        bent=(step.broken and _bent(step, look, even=even))
        or (not even and covariance_model.another(line, agreeing, contrast=found.contrast, dark=found.dark))
        or (
            even
            and not blur_known
            and covariance_model.covering(line, agreeing, contrast=found.contrast, dark=found.dark)
        ),
        pulled=moves is not None or sigma.pulled,
        path_px=path_px,
        edges=sigma.edges,
        goes_on=not blur_known and _goes_on(step),
    )

"""From a rough quadrilateral to its exact corners: search if needed, then passes of profiles and lines."""

from dataclasses import dataclass
from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking import belief, doubts, edges, lines, steps
from pi_agent.tracking.pixels import PixelReader

Floats = NDArray[np.float64]
Points = NDArray[np.complex128]

PROFILES = 48  # the last pass reads so many on each edge
SEARCHED = 14  # a search reads so many
DIM = 20.0, 12.0, 7.0  # contrasts (of 255) below which the noise of the pixels counts more than the texture
LEAST_CONTRAST = 6.0  # of 255, in linear light: dim scenes have little more
ALL_SHARP, NO_PATH = np.ones(4), np.zeros(4)
FLOOR_PX = 0.012  # scatter of the edge points that is always believed
SETTLED = 0.5, 0.05  # corrections of place and of blur, in shares of the blur, that need no further pass
SETTLED_BESIDE_MARGIN = 1.2, 0.05  # the same where the estimator leans on neither side
FAR = 0.6  # in blur deviations
FOUND = 0.08, 0.015  # the same while the blur is being found, or is not the lens's alone
BLUR_ALIKE = 0.12  # edges whose blurs differ by less share one: the lens's
BLUR_RANGE_PX = (0.55, 4.0)


@dataclass(frozen=True)
class Task:
    """What stays the same from frame to frame.

    The estimators for an unknown and for a known blur, in good and in dim light (all one beside an even margin, where
    it does not matter), those for a moving mark, and the part of each edge that is no edge (a notch).
    """

    model: steps.StepModel
    known: steps.StepModel
    dim: tuple[steps.StepModel, ...]
    moving: steps.SmearedModels
    left_out: Floats | None = None

    @staticmethod
    def beside(*, textured: bool, left_out: Floats | None = None) -> "Task":
        """The task for bare tape on a textured plate, or for a mark with its own margin."""
        model, moving = steps.step_model(textured=textured), steps.smeared_models(textured=textured)
        if not textured:
            return Task(model, model, (model,) * len(DIM), moving, left_out)
        known = steps.step_model(textured=True, known_blur=True)
        dim = tuple(steps.step_model(textured=True, known_blur=True, noise=noise) for noise in steps.DIM_NOISE)
        return Task(model, known, dim, moving, left_out)

    @property
    def even(self) -> bool:
        """Whether the mark lies in an even margin."""
        return self.known is self.model

    def estimator(self, *, known_blur: bool, contrast: float) -> steps.StepModel:
        """The estimator at a contrast (of 255)."""
        if not known_blur:
            return self.model
        level = sum(contrast < limit for limit in DIM)
        return self.known if level == 0 else self.dim[level - 1]


@dataclass(frozen=True)
class Smear:
    """The way of a moving mark within the exposure: that of its centre (px), and its turn (rad) about it."""

    centre: complex
    path_px: complex
    turn_rad: float

    def across(self, points: Points, tangent: Points) -> Floats:
        """How far the edges with these tangents (4, 1) move across themselves at points (4, n), in px."""
        return np.abs((np.conj(tangent) * (self.path_px + 1j * self.turn_rad * (points - self.centre))).imag)


@dataclass(frozen=True)
class Sweep:
    """How a rolling shutter bends a turning mark: its centre, velocity and yaw rate, time per row (px, rad, s).

    Only what is quadratic in the rows matters here; the linear part stays in the corners, which are reported where and
    when their own rows saw them. An error of the velocity is of no account for the same reason.
    """

    centre: complex
    velocity_px_s: complex
    yaw_rate_rad_s: float
    line_s: float

    def shift(self, points: Points) -> Points:
        """How far the points have moved, by the time at which their rows are exposed, since the centre's row was."""
        velocity = self.velocity_px_s + 1j * self.yaw_rate_rad_s * (points - self.centre)
        return velocity * ((points.imag - self.centre.imag) * self.line_s)

    def as_seen(self, corners: Points) -> Points:
        """Corners at their own rows' times from corners at the time of the centre's row."""
        seen = corners + self.shift(corners)
        return corners + self.shift(seen)


@dataclass(frozen=True)
class Fit:
    """The refined quadrilateral.

    Corners (4,) x + i y, sigma of one coordinate, of all corners and of the worst, RMS distance of the edge points,
    share of each edge's readable profiles that agree (4,), contrast, blur of each edge (4,), share of saturated
    profiles, whether neighbouring profiles show an edge beside the line of theirs, the least share of an edge's
    profiles that agree, readable or not, whether an edge is pulled by uneven light, and the path within the
    exposure that was reckoned with.
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


def search_edges(reader: PixelReader, corners: Points, *, reach_px: int) -> Points | None:
    """Corners (4,) to within about half a pixel from ones that are up to `reach_px` off; None without edges."""
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
    sweep: Sweep | None = None,
    smear: Smear | None = None,
) -> Fit | None:
    """The exact corners from ones that are within about a pixel; None when there is no mark.

    `blur_px`: (4,) expected blur of the edges, with `smear` that of the lens; `blur_known`: from earlier frames. When
    it is not, all edges are fitted with blurs of their own first, then with the one that they share, if they do. Ends
    when a pass changed little.
    """
    blur = _within(blur_px, *BLUR_RANGE_PX)
    known = blur_known or smear is not None
    still = SETTLED_BESIDE_MARGIN if task.even else SETTLED
    limit = still if blur_known else FOUND
    contrast = np.inf
    for left in range(most_passes - 1, -1, -1):
        model = task.estimator(known_blur=known, contrast=contrast)
        look = _look(corners, blur, model=model, task=task, smear=smear)
        step = _one_pass(reader, look, task=task, shared_blur=known, sweep=sweep, smear=smear)
        if step is None:
            return None
        contrast = step.contrast
        blur_right = step.blur_change < limit[1]
        settled = blur_right and step.moved < limit[0] and task.estimator(known_blur=known, contrast=contrast) is model
        corners, blur = step.corners, blur if blur_known and blur_right else step.blur_px
        if not known and float(blur.max()) < (1.0 + BLUR_ALIKE) * float(blur.min()):
            blur, known, settled = np.full(4, blur.mean()), True, False
        if settled or left == 0:
            fit = _fit(step, look, even=task.even, path_px=0.0 if smear is None else abs(smear.path_px))
            # From further away an edge seems to lie in uneven light that does not.
            if left == 0 or not fit.pulled or step.moved < SETTLED[0]:
                return fit
    return None


class _Look(NamedTuple):
    """One pass: the edges as expected, the blur of the lens, the estimators.

    `path`: the way across each edge within the exposure (4,) that its estimator is made for; `width`: deviation of
    blur and smear together; `sharp`: how much an edge tells of the lens's blur, 1 without smear.
    """

    corners: Points
    blur: Floats
    expected: lines.Edges
    model: steps.StepModel
    path: Floats
    width: Floats
    sharp: Floats


def _look(corners: Points, blur: Floats, *, model: steps.StepModel, task: Task, smear: Smear | None) -> _Look:
    clear_px = 1.0 + 3.0 * float(blur.max())
    if smear is None:
        return _Look(corners, blur, lines.expected_edges(corners, clear_px=clear_px), model, NO_PATH, blur, ALL_SHARP)
    step = corners[lines.NEXT] - corners
    path = smear.across((corners + 0.5 * step)[:, None], (step / np.abs(step))[:, None])[:, 0]
    expected = lines.expected_edges(corners, clear_px=clear_px + 0.5 * float(path.max()))
    width = np.sqrt(blur**2 + path**2 / 12.0)
    estimators, smears = task.moving.at(path / blur)
    return _Look(corners, blur, expected, estimators, smears * blur, width, (blur / width) ** 4)


class _Step(NamedTuple):
    """What a pass found.

    The corners, the blurs and the contrast (see `Fit`); the largest corrections, of a corner in blur deviations and of
    the blur in shares of it; and what the doubts are told by: the profiles, which of them are believed (4, n), how far
    two estimators disagree (4, n), the lines, and how much wider each edge seems than its blur (4,).
    """

    corners: Points
    blur_px: Floats
    contrast: float
    moved: float
    blur_change: float
    found: edges.Profiles
    believed: Floats
    pull: Floats
    line: lines.LineFit
    wider: Floats


def _one_pass(
    reader: PixelReader, look: _Look, *, task: Task, shared_blur: bool, sweep: Sweep | None, smear: Smear | None
) -> _Step | None:
    expected = look.expected
    if expected.length.min() < 8.0:
        return None
    found = edges.measure(reader, expected, blur_px=look.blur, count=PROFILES, model=look.model)
    typical = float(np.partition(found.contrast.ravel(), found.contrast.size // 2)[found.contrast.size // 2])
    if typical < LEAST_CONTRAST:
        return None
    weight = belief.believed(found, typical, look.width)
    found = belief.level(found, weight, look.model, blur=look.blur, typical=typical, even=task.even)
    if task.even:
        found = belief.through_shadow(found, weight, typical)
    if task.left_out is not None:
        belief.leave_out(weight, expected, task.left_out)
    counted = np.add.reduce(weight, axis=1)
    if counted.min() < PROFILES // 4:
        return None
    offset, pull = _straightened(found, look, smear=smear, sweep=sweep)
    line = _robust_lines(offset, weight, counted, expected)
    spoiled = doubts.beside_a_gap(line, blur_px=float(look.blur.max()), shortest_px=float(expected.free.min()))
    if spoiled is not None:
        kept = np.where(spoiled, 0.0, weight)
        line = _robust_lines(offset, kept, np.add.reduce(kept, axis=1), expected)
    if line.moments[:, 0].min() < PROFILES / 6:
        return None
    refined = lines.intersect(expected, line.offset, line.rise)
    if sweep is not None:
        refined = sweep.as_seen(refined)
    wider, change = _blur_change(found, line, look, shared_blur=shared_blur)
    blur = _within(look.blur * (1.0 + _within(change, -0.3, 0.3)), *BLUR_RANGE_PX)
    moved = max((np.abs(refined - look.corners) / look.width).tolist())
    largest = max(np.abs(change).tolist())
    return _Step(refined, blur, typical, moved, largest, found, weight, pull, line, wider)


def _within(values: Floats, low: float, high: float) -> Floats:
    """As np.clip, in less than half its time for four numbers."""
    return np.minimum(np.maximum(values, low), high)


def _blur_change(
    found: edges.Profiles, line: lines.LineFit, look: _Look, *, shared_blur: bool
) -> tuple[Floats, Floats]:
    """How much wider (4,) each edge seems, and by how much its blur is to be changed; both in shares of the blur."""
    total = line.moments[:, 0]
    wider = np.add.reduce(line.weight * found.blur_change, axis=1) / total
    # Further away the blur cannot be told, and there will be another pass.
    far = np.add.reduce(line.weight * np.abs(found.offset), axis=1) / total
    change = np.where(far < FAR * look.width, wider, 0.0)
    if shared_blur:
        change = np.full(4, float(np.vdot(look.sharp, change)) / float(look.sharp.sum()))
    return wider, change


def _straightened(
    found: edges.Profiles, look: _Look, *, smear: Smear | None, sweep: Sweep | None
) -> tuple[Floats, Floats]:
    """Offset and pull (4, n) without what a turn does to them: smears that differ along an edge, and bent edges."""
    tangent, model = look.expected.tangent[:, None], look.model
    offset, pull = found.offset, found.pull
    if smear is not None:
        longer = smear.across(found.base, tangent) - look.path[:, None]
        offset = offset - model.smear_gain[:, None] * longer
        pull = pull - (model.other_gain - model.smear_gain)[:, None] * longer
    if sweep is not None:
        offset = offset - (1j * np.conj(tangent) * sweep.shift(found.base)).real
    return offset, pull


def _fit(step: _Step, look: _Look, *, even: bool, path_px: float) -> Fit:
    """The fit of the last pass, with what is to be said about its doubts."""
    found, line, expected = step.found, step.line, look.expected
    moves: Points | None = None
    if even:
        moves, pull, line = doubts.out_of_shadow(step.pull, line, expected, contrast=found.contrast)
        sigma = doubts.margin_sigma(pull, lines.scatter_variance(line, expected), contrast=step.contrast)
    else:
        pull = doubts.corner_pull(step.pull, line, expected)
        blur_off_px = step.wider * look.blur * look.sharp
        sigma = doubts.grain_sigma(pull, line, expected, blur_off_px=blur_off_px, contrast=step.contrast)
    agreeing = np.add.reduce(line.weight > doubts.AGREES, axis=1)
    return Fit(
        corners=step.corners if moves is None else step.corners + moves,
        sigma_px=sigma.mean_px,
        worst_px=sigma.worst_px,
        residual_px=sqrt(float(np.vdot(line.weight, line.residual * line.residual)) / sum(line.moments[:, 0].tolist())),
        agreement=agreeing / belief.readable(found),
        whole=float(agreeing.min()) / PROFILES,
        contrast=step.contrast,
        blur_px=step.blur_px,
        saturated=0.0 if found.saturated is None else float(found.saturated.mean()),
        bent=doubts.bent(line, step.believed, shortest_px=float(expected.free.min())),
        pulled=moves is not None or sigma.pulled,
        path_px=path_px,
    )


def _robust_lines(offset: Floats, weight: Floats, counted: Floats, expected: lines.Edges) -> lines.LineFit:
    """Plain robust fits where nearly all profiles are good; where not, from the line that most of them agree with."""
    if counted.min() > 0.9 * PROFILES:
        fit = lines.fit_lines(offset, weight, start=None, floor_px=FLOOR_PX, rounds=2)
        if fit.moments[:, 0].min() > 0.7 * PROFILES:
            return fit
    some = slice(None, None, 2)
    start = lines.vote(offset[:, some], weight[:, some], tolerance=0.4, largest_rise=0.15 * expected.free)
    return lines.fit_lines(offset, weight, start=start, floor_px=FLOOR_PX, rounds=3)

"""One pass over the edges: profiles across them, the profiles' weights, and the lines through those that count."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking import covariance_model, edges, lines, profile_weights, steps
from pi_agent.tracking.motion_blur import MotionBlur, bend
from pi_agent.tracking.pixels import PixelReader

Floats = NDArray[np.float64]
Points = NDArray[np.complex128]

PROFILES = 48  # number of profiles that are read on each edge
DIM = 20.0, 12.0, 7.0  # contrasts (of 255) below which the noise of the pixels counts more than the texture
LEAST_CONTRAST = 6.0  # least contrast of a mark (of 255, in linear light): dim scenes have little more
ALL_PROFILES = np.full(4, float(PROFILES))
ALL_SHARP, NO_PATH = np.ones(4), np.zeros(4)
FLOOR_PX = 0.012  # smallest scatter of the edge points that is assumed
READ = 0.75  # share of an edge's profiles that must have a weight for a plain fit
MOSTLY = 0.7  # share of those that must agree with a plain fit
FAR = 0.6  # distance of an edge, in blur deviations, from which its blur is not read
BLUR_RANGE_PX = (0.55, 4.0)


@dataclass(frozen=True)
class Task:
    """The task that stays the same from frame to frame.

    The estimators for an unknown and for a known blur, in good and in dim light (all one beside an even margin, where
    it does not matter), those for a moving mark, and the part of each edge that is no edge (a notch).
    """

    model: steps.StepModel
    known: steps.StepModel
    dim: tuple[steps.StepModel, ...]
    moving: steps.MovingModels
    left_out: Floats | None = None

    @staticmethod
    def beside(*, textured: bool, left_out: Floats | None = None) -> "Task":
        """Returns the task for bare tape on a textured plate, or for a mark with its own margin.

        `left_out` (4, 2) is where the part of each edge begins and ends that is no edge, in sides from its start; None:
        nowhere.
        """
        model, moving = steps.step_model(textured=textured), steps.moving_models(textured=textured)
        if not textured:
            return Task(model, model, (model,) * len(DIM), moving, left_out)
        known = steps.step_model(textured=True, known_blur=True)
        dim = tuple(steps.step_model(textured=True, known_blur=True, noise=noise) for noise in steps.DIM_NOISE)
        return Task(model, known, dim, moving, left_out)

    @property
    def even(self) -> bool:
        """True if the mark lies in an even margin."""
        return self.known is self.model

    def estimator(self, *, known_blur: bool, contrast: float) -> steps.StepModel:
        """Returns the estimator at a contrast (of 255)."""
        if not known_blur:
            return self.model
        level = sum(contrast < limit for limit in DIM)
        return self.known if level == 0 else self.dim[level - 1]


class Look(NamedTuple):
    """The start of a pass: the edges as expected, the blur of the lens, the estimators.

    `path`: the way across each edge within the exposure (4,) that its estimator is made for; `width`: deviation of
    all blur; `sharp`: how much an edge tells of the lens's blur, 1 without motion blur; `inwards`: the ways of the
    edges' middles.
    """

    corners: Points
    blur: Floats
    expected: lines.Edges
    model: steps.StepModel
    path: Floats
    width: Floats
    sharp: Floats
    inwards: list[float]


def look_at(
    corners: Points, blur: Floats, *, model: steps.StepModel, task: Task, motion_blur: MotionBlur | None
) -> Look:
    """Returns a pass about corners (4,), with the lens's blur (4,) in px; `model` is used when nothing moves."""
    clear_px = 1.0 + 3.0 * max(blur.tolist())
    if motion_blur is None:
        return Look(
            corners, blur, lines.expected_edges(corners, clear_px=clear_px), model, NO_PATH, blur, ALL_SHARP, []
        )
    outline = lines.expected_edges(corners, clear_px=clear_px)
    inwards = motion_blur.inwards(outline)
    path = np.abs(inwards)
    expected = lines.shortened(outline, clear_px=clear_px + 0.5 * max(path.tolist()))
    width = np.sqrt(blur**2 + path**2 / 12.0)
    estimators, motion_blurs = task.moving.at(path / blur)
    return Look(corners, blur, expected, estimators, motion_blurs * blur, width, (blur / width) ** 4, inwards)


class Step(NamedTuple):
    """The findings of a pass: the corners, and what covariance model and validation gate look at.

    Attributes:
        corners: (4,) the corners x + i y, px.
        blur_px: (4,) blur of each edge.
        contrast: step of the light across the edges, of 255.
        moved: largest correction of a corner, in blur deviations.
        blur_change: largest correction of the blur, in shares of it.
        found: the profiles' readings.
        profile_weight: (4, n) weights of the profiles.
        pull: (4, n) disagreement of two estimators, px.
        line: the lines through the edge points.
        wider: (4,) factor by which each edge seems wider than its blur.
        uneven: True if the light differs along the outline.
        telling: share of the profiles that show the blur.
        broken: True if three profiles in a row disagreed with the first lines; without that no edge is bent.
        profiles: (4,) number of profiles of each edge, without those in a notch.
    """

    corners: Points
    blur_px: Floats
    contrast: float
    moved: float
    blur_change: float
    found: edges.Profiles
    profile_weight: Floats
    pull: Floats
    line: lines.LineFit
    wider: Floats
    uneven: bool
    telling: float
    broken: bool
    profiles: Floats


def one_pass(
    reader: PixelReader,
    look: Look,
    *,
    task: Task,
    shared_blur: bool,
    motion_blur: MotionBlur | None,
    turn_per_row_rad: float,
) -> Step | None:
    """Gives the findings of a pass; None when there is no mark. `shared_blur`: the edges have one blur, the lens's."""
    expected = look.expected
    if min(expected.length.tolist()) < 8.0:
        return None
    found = edges.measure(reader, expected, blur_px=look.blur, count=PROFILES, model=look.model)
    typical = float(np.partition(found.contrast.ravel(), found.contrast.size // 2)[found.contrast.size // 2])
    if typical < LEAST_CONTRAST:
        return None
    weight = profile_weights.weights_of(found, typical, look.width)
    found = profile_weights.level(found, weight, look.model, blur=look.blur, typical=typical, even=task.even)
    unevenness = 0.0
    if task.even:
        unevenness = profile_weights.beside_another(found, weight)
        if unevenness > profile_weights.EVEN:
            found = profile_weights.through_shadow(found, weight, typical)
    profiles = ALL_PROFILES
    if task.left_out is not None:
        profiles = profile_weights.leave_out(weight, expected, task.left_out)
    counted = np.add.reduce(weight, axis=1)
    if min(counted.tolist()) < PROFILES // 4:
        return None
    offset, pull = _straightened(found, look, motion_blur=motion_blur, turn_per_row_rad=turn_per_row_rad)
    line = _robust_lines(offset, weight, counted, expected)
    spoiled = covariance_model.beside_a_gap(
        line, blur_px=max(look.blur.tolist()), shortest_px=min(expected.free.tolist())
    )
    broken = spoiled is not None
    if spoiled is not None:
        kept = np.where(spoiled, 0.0, weight)
        line = _robust_lines(offset, kept, np.add.reduce(kept, axis=1), expected)
    if min(line.moments[:, 0].tolist()) < PROFILES / 6:
        return None
    refined = lines.intersect(expected, line.offset, line.rise)
    wider, change, telling = blur_change(found, line, look, shared_blur=shared_blur)
    blur = within(look.blur * (1.0 + within(change, -0.3, 0.3)), *BLUR_RANGE_PX)
    moved = max((np.abs(refined - look.corners) / look.width).tolist())
    largest = max(np.abs(change).tolist())
    uneven = unevenness > profile_weights.UNEVEN
    rest = wider, uneven, telling, broken, profiles
    return Step(refined, blur, typical, moved, largest, found, weight, pull, line, *rest)


def within(values: Floats, low: float, high: float) -> Floats:
    """Clips `values` (4,), in any unit, as np.clip does, in less than half its time; the result has the same shape."""
    return np.minimum(np.maximum(values, low), high)


def blur_change(
    found: edges.Profiles, line: lines.LineFit, look: Look, *, shared_blur: bool
) -> tuple[Floats, Floats, float]:
    """Returns the shares of the blur by which each edge (4,) seems wider, and by which its blur is to be changed.

    Told by the profiles on which no highlight lies: a few among many that tell nothing count as much as if they were
    alone. Their share is the third answer.
    """
    total, weight, sharp, share = line.moments[:, 0], line.weight, look.sharp, 1.0
    clear = total
    if found.glowing is not None:
        weight = weight * ~found.glowing
        clear = np.add.reduce(weight, axis=1)
        sharp = sharp * clear
        share = float(clear.sum() / total.sum())
    wider = np.add.reduce(weight * found.blur_change, axis=1) / np.maximum(clear, 1.0)
    # Further away the blur cannot be told, and there will be another pass.
    far = np.add.reduce(line.weight * np.abs(found.offset), axis=1) < (FAR * look.width) * total
    change = wider * far
    if shared_blur:
        change.fill(float(np.vdot(sharp, change)) / max(sum(sharp.tolist()), 1e-9))
    return wider, change, share


def _straightened(
    found: edges.Profiles, look: Look, *, motion_blur: MotionBlur | None, turn_per_row_rad: float
) -> tuple[Floats, Floats]:
    """Returns offset and pull (4, n) without what a turn does to them.

    A turn makes motion blur differ along an edge, and bends edges.
    """
    if motion_blur is None and turn_per_row_rad == 0.0:
        return found.offset, found.pull
    terms = np.zeros((8, 3))
    if motion_blur is not None:
        longer, gain = motion_blur.longer(look.expected, look.inwards, than=look.path), look.model.motion_blur_gain
        terms[:4, :2] = gain[:, None] * longer
        terms[4:, :2] = (look.model.other_gain - gain)[:, None] * longer
    if turn_per_row_rad != 0.0:
        terms[:4] += bend(look.expected, turn_per_row_rad=turn_per_row_rad)
    away = lines.along(terms, count=found.offset.shape[1])
    return found.offset - away[:4], found.pull - away[4:]


def _robust_lines(offset: Floats, weight: Floats, counted: Floats, expected: lines.Edges) -> lines.LineFit:
    """Returns plain robust fits where nearly all profiles are good.

    Elsewhere the fits begin at the line that most of them agree with.
    """
    if min(counted.tolist()) > READ * PROFILES:
        fit = lines.fit_lines(offset, weight, start=None, floor_px=FLOOR_PX, rounds=2)
        if all((fit.moments[:, 0] > MOSTLY * counted).tolist()):
            return fit
    some = slice(None, None, 2)
    start = lines.vote(offset[:, some], weight[:, some], tolerance=0.4, largest_rise=0.15 * expected.free)
    return lines.fit_lines(offset, weight, start=start, floor_px=FLOOR_PX, rounds=3)

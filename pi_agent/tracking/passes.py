"""One pass: profiles across the expected edges, which of them are believed, and the lines through those."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking import belief, doubts, edges, lines, steps
from pi_agent.tracking.pixels import PixelReader
from pi_agent.tracking.smear import Smear, bend

Floats = NDArray[np.float64]
Points = NDArray[np.complex128]

PROFILES = 48  # read on each edge
DIM = 20.0, 12.0, 7.0  # contrasts (of 255) below which the noise of the pixels counts more than the texture
LEAST_CONTRAST = 6.0  # of 255, in linear light: dim scenes have little more
ALL_PROFILES = np.full(4, float(PROFILES))
ALL_SHARP, NO_PATH = np.ones(4), np.zeros(4)
FLOOR_PX = 0.012  # scatter of the edge points that is always believed
READ = 0.75  # share of an edge's profiles that must be believed for a plain fit
MOSTLY = 0.7  # weight of those, in shares, from which a plain fit is one of most of them
FAR = 0.6  # in blur deviations
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
        """True if the mark lies in an even margin."""
        return self.known is self.model

    def estimator(self, *, known_blur: bool, contrast: float) -> steps.StepModel:
        """The estimator at a contrast (of 255)."""
        if not known_blur:
            return self.model
        level = sum(contrast < limit for limit in DIM)
        return self.known if level == 0 else self.dim[level - 1]


class Look(NamedTuple):
    """The start of a pass: the edges as expected, the blur of the lens, the estimators.

    `path`: the way across each edge within the exposure (4,) that its estimator is made for; `width`: deviation of
    blur and smear together; `sharp`: how much an edge tells of the lens's blur, 1 without smear; `inwards`: the ways of
    the edges' middles.
    """

    corners: Points
    blur: Floats
    expected: lines.Edges
    model: steps.StepModel
    path: Floats
    width: Floats
    sharp: Floats
    inwards: list[float]


def look_at(corners: Points, blur: Floats, *, model: steps.StepModel, task: Task, smear: Smear | None) -> Look:
    """A pass about corners (4,), with the lens's blur (4,) in px; `model` is used when nothing moves."""
    clear_px = 1.0 + 3.0 * max(blur.tolist())
    if smear is None:
        return Look(
            corners, blur, lines.expected_edges(corners, clear_px=clear_px), model, NO_PATH, blur, ALL_SHARP, []
        )
    outline = lines.expected_edges(corners, clear_px=clear_px)
    inwards = smear.inwards(outline)
    path = np.abs(inwards)
    expected = lines.shortened(outline, clear_px=clear_px + 0.5 * max(path.tolist()))
    width = np.sqrt(blur**2 + path**2 / 12.0)
    estimators, smears = task.moving.at(path / blur)
    return Look(corners, blur, expected, estimators, smears * blur, width, (blur / width) ** 4, inwards)


class Step(NamedTuple):
    """The findings of a pass.

    The corners, the blurs and the contrast (see `Fit`); the largest corrections, of a corner in blur deviations and of
    the blur in shares of it; and what the doubts are told by: the profiles, which of them are believed (4, n), how far
    two estimators disagree (4, n), the lines, how much wider each edge seems than its blur (4,), whether the light
    differs along the outline, the share of the profiles that told the blur, whether three profiles on end disagreed
    with the first lines (without that no edge is bent), and how many profiles each edge has but for a notch (4,).
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
    uneven: bool
    telling: float
    broken: bool
    profiles: Floats


def one_pass(
    reader: PixelReader, look: Look, *, task: Task, shared_blur: bool, smear: Smear | None, turn_per_row_rad: float
) -> Step | None:
    """The findings of a pass; None when there is no mark. `shared_blur`: the edges have one blur, the lens's."""
    expected = look.expected
    if min(expected.length.tolist()) < 8.0:
        return None
    found = edges.measure(reader, expected, blur_px=look.blur, count=PROFILES, model=look.model)
    typical = float(np.partition(found.contrast.ravel(), found.contrast.size // 2)[found.contrast.size // 2])
    if typical < LEAST_CONTRAST:
        return None
    weight = belief.believed(found, typical, look.width)
    found = belief.level(found, weight, look.model, blur=look.blur, typical=typical, even=task.even)
    unevenness = 0.0
    if task.even:
        unevenness = belief.beside_another(found, weight)
        if unevenness > belief.EVEN:
            found = belief.through_shadow(found, weight, typical)
    profiles = ALL_PROFILES
    if task.left_out is not None:
        profiles = belief.leave_out(weight, expected, task.left_out)
    counted = np.add.reduce(weight, axis=1)
    if min(counted.tolist()) < PROFILES // 4:
        return None
    offset, pull = _straightened(found, look, smear=smear, turn_per_row_rad=turn_per_row_rad)
    line = _robust_lines(offset, weight, counted, expected)
    spoiled = doubts.beside_a_gap(line, blur_px=max(look.blur.tolist()), shortest_px=min(expected.free.tolist()))
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
    uneven = unevenness > belief.UNEVEN
    told = wider, uneven, telling, broken, profiles
    return Step(refined, blur, typical, moved, largest, found, weight, pull, line, *told)


def within(values: Floats, low: float, high: float) -> Floats:
    """As np.clip, in less than half its time for four numbers."""
    return np.minimum(np.maximum(values, low), high)


def blur_change(
    found: edges.Profiles, line: lines.LineFit, look: Look, *, shared_blur: bool
) -> tuple[Floats, Floats, float]:
    """The shares of the blur by which each edge (4,) seems wider, and by which its blur is to be changed.

    Told by the profiles on which no highlight lies: a few among many that tell nothing count as much as if they were
    alone. Their share is the third answer.
    """
    total, weight, sharp, share = line.moments[:, 0], line.weight, look.sharp, 1.0
    told = total
    if found.glowing is not None:
        weight = weight * ~found.glowing
        told = np.add.reduce(weight, axis=1)
        sharp = sharp * told
        share = float(told.sum() / total.sum())
    wider = np.add.reduce(weight * found.blur_change, axis=1) / np.maximum(told, 1.0)
    # Further away the blur cannot be told, and there will be another pass.
    far = np.add.reduce(line.weight * np.abs(found.offset), axis=1) < (FAR * look.width) * total
    change = wider * far
    if shared_blur:
        change.fill(float(np.vdot(sharp, change)) / max(sum(sharp.tolist()), 1e-9))
    return wider, change, share


def _straightened(
    found: edges.Profiles, look: Look, *, smear: Smear | None, turn_per_row_rad: float
) -> tuple[Floats, Floats]:
    """Offset and pull (4, n) without what a turn does to them: smears that differ along an edge, and bent edges."""
    if smear is None and turn_per_row_rad == 0.0:
        return found.offset, found.pull
    terms = np.zeros((8, 3))
    if smear is not None:
        longer, gain = smear.longer(look.expected, look.inwards, than=look.path), look.model.smear_gain
        terms[:4, :2] = gain[:, None] * longer
        terms[4:, :2] = (look.model.other_gain - gain)[:, None] * longer
    if turn_per_row_rad != 0.0:
        terms[:4] += bend(look.expected, turn_per_row_rad=turn_per_row_rad)
    away = lines.along(terms, count=found.offset.shape[1])
    return found.offset - away[:4], found.pull - away[4:]


def _robust_lines(offset: Floats, weight: Floats, counted: Floats, expected: lines.Edges) -> lines.LineFit:
    """Plain robust fits where nearly all profiles are good; where not, from the line that most of them agree with."""
    if min(counted.tolist()) > READ * PROFILES:
        fit = lines.fit_lines(offset, weight, start=None, floor_px=FLOOR_PX, rounds=2)
        if all((fit.moments[:, 0] > MOSTLY * counted).tolist()):
            return fit
    some = slice(None, None, 2)
    start = lines.vote(offset[:, some], weight[:, some], tolerance=0.4, largest_rise=0.15 * expected.free)
    return lines.fit_lines(offset, weight, start=start, floor_px=FLOOR_PX, rounds=3)

"""Acquisition: finds the mark without knowing where it is, how it moves, or how sharp the lens is."""

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking import identity, validation_gate
from pi_agent.tracking.config import TrackerConfig
from pi_agent.tracking.motion import STILL
from pi_agent.tracking.passes import Task
from pi_agent.tracking.pixels import PixelReader
from pi_agent.tracking.quadrilaterals import candidates
from pi_agent.tracking.refine import Fit, refine, search_edges

Points = NDArray[np.complex128]
Frame = NDArray[np.uint8]
Attempt = tuple[Fit | None, validation_gate.Verdict]
Seen = tuple[Fit, validation_gate.Verdict]

MOST_PASSES = 5
SEARCHED_PX = 5  # distance from a candidate within which its edges are searched for
DETECT_EVERY = 10  # frames without an outline from one call of OpenCV's tag detector to the next
NO_MARK = validation_gate.Verdict("no mark in this frame")
MOVES = validation_gate.Verdict("motion blur: the mark moves, and its speed is not known yet", rough=True)


class Acquisition:
    """Looks for a mark in the whole frame (or the region)."""

    def __init__(self, config: TrackerConfig, reader: PixelReader, feature: identity.FeatureReader, task: Task) -> None:
        self._config, self._reader, self._feature, self._task = config, reader, feature, task
        self._whole_task = Task.beside(textured=config.mark.margin <= 0)
        self._dropout = 0

    def found(self) -> None:
        """Notes that there is a mark: a dropout ends."""
        self._dropout = 0

    def look(self, frame: Frame, why: validation_gate.Verdict, *, blur_px: float) -> Attempt:
        """Gives the candidate that is accepted, when it is the only one; else none, and why (`why` when there is none).

        Its corners are named by its shape alone.

        Args:
            frame: (height, width) the frame that the reader has open, 8-bit grey values.
            why: the verdict that is given when there is no candidate.
            blur_px: the expected blur of the lens, px.
        """
        left, top, width, height = self._config.region_px or (0, 0, frame.shape[1], frame.shape[0])
        part = frame[max(top, 0) : top + height, max(left, 0) : left + width]
        origin = complex(max(left, 0), max(top, 0))
        accepted: list[Seen] = []
        quads = candidates(part, side_px=self._config.side_px, aspect=self._config.mark.aspect)
        for quad in quads or self._tag_outline(part):
            fit, verdict = self._fitted(quad + origin, blur_px)
            if fit is not None and (not verdict.reason or verdict.rough):
                accepted.append((fit, verdict))
            elif fit is not None:
                why = verdict
        return self._only_one(accepted) if accepted else (None, why)

    def _tag_outline(self, part: Frame) -> list[Points]:
        """Returns the tag by OpenCV's detector, when no outline stands alone.

        That is slow, so it is not done in every frame of a dropout.
        """
        if self._config.mark.feature != "tag":
            return []
        self._dropout += 1
        quad = identity.detect_tag(part, self._config.mark) if self._dropout % DETECT_EVERY == 1 else None
        return [] if quad is None else [quad]

    def _fitted(self, quad: Points, blur_px: float) -> Attempt:
        near = search_edges(self._reader, quad, reach_px=SEARCHED_PX)
        if near is None or not inside(near, self._reader):
            return None, NO_MARK
        near = np.roll(near, -identity.first_turn(near, aspect=self._config.mark.aspect))
        fit = refine(self._reader, near, blur_px=np.full(4, blur_px), task=self._whole_task, most_passes=MOST_PASSES)
        if fit is None:
            return None, NO_MARK
        verdict = validation_gate.verdict_on(fit, config=self._config, shape=None, way=STILL)
        if (
            not verdict.reason
            and not self._task.even
            and self.unknown_path_px(fit, blur_px=blur_px) > validation_gate.MOTION_BLUR_PX
        ):
            verdict = MOVES
        return fit, verdict

    def _only_one(self, accepted: list[Seen]) -> Attempt:
        if self._config.mark.feature != "none":
            accepted = [pair for pair in accepted if self._feature.turn(self._reader, pair[0].corners) is not None]
        if len(accepted) == 1:
            return accepted[0]
        if not accepted:
            return None, validation_gate.Verdict("a mark, but its feature cannot be read")
        return None, validation_gate.Verdict("two marks in this frame: cover one, or set the mark's size")

    def without_notch(self, named: Fit, verdict: validation_gate.Verdict) -> Attempt:
        """Returns the acquisition once more when it has shown where the notch is: no edge is seen in part for that."""
        if self._task.left_out is None or verdict.reason:
            return named, verdict
        again = refine(self._reader, named.corners, blur_px=named.blur_px, task=self._task, most_passes=MOST_PASSES)
        if again is None:
            return None, NO_MARK
        return again, validation_gate.verdict_on(again, config=self._config, shape=None, way=STILL)

    def unknown_path_px(self, fit: Fit, *, blur_px: float) -> float:
        """Returns the path within the exposure that would make the lens's blur the one that was found."""
        if self._config.shutter.exposure_ns == 0:
            return 0.0
        lens = min(blur_px, float(fit.blur_px.min()))
        return sqrt(max(12.0 * (float(np.mean(fit.blur_px**2)) - lens**2), 0.0))


def inside(corners: Points, reader: PixelReader, *, clear_px: int = 2) -> bool:
    """Returns true if the corners (4,) lie in the frame, `clear_px` clear of its border."""
    x, y = corners.real.tolist(), corners.imag.tolist()
    right, bottom = reader.width - 1 - clear_px, reader.height - 1 - clear_px
    return bool(min(x) > clear_px and min(y) > clear_px and max(x) < right and max(y) < bottom)

"""Remembers of the mark: the lens's blur, its outline where it lies, its shape from place to place.

A rolling shutter makes a mark that moves another shape. What it makes is known where the speed is: not in acquisition,
nor in the frame of a blow. What is seen then is compared with what is remembered as far as it can be, and not learned.
"""

from math import degrees

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking import validation_gate
from pi_agent.tracking.config import TrackerConfig
from pi_agent.tracking.motion import STILL, Way, unsheared
from pi_agent.tracking.refine import Fit
from pi_agent.tracking.resting import NEAR_ON_TEXTURE_PX, NEAR_PX, RestingShape, lean_of, noise_px
from pi_agent.tracking.shape_filter import Settled, ShapeFilter

Points = NDArray[np.complex128]

LEARNING = 0.05  # share of the newest frame in the blur and the shape that are remembered
STEADY_PX = 0.03  # largest change by an unsteady speed of an outline that is learned
MOST_DEPARTED = 45  # frames after which a changed outline is the mark's: half a second at 90 Hz


class Memory:
    """The memory of one mark between frames: the lens's `blur_px`, and its `shape` when it lay flat (`flat_shape`)."""

    def __init__(self, config: TrackerConfig) -> None:
        self._config, self._line_s = config, config.shutter.line_s
        self.blur_px = config.blur_px
        self.blur_known = False
        self.shape: validation_gate.Shape | None = None
        self._forget_outline()

    def _forget_outline(self) -> None:
        near_px = NEAR_ON_TEXTURE_PX if self._config.mark.margin <= 0 else NEAR_PX
        self._resting = RestingShape(near_px=near_px, line_s=self._line_s)
        self._shape_filter = ShapeFilter(line_s=self._line_s)
        self._departed = 0

    def unsteady_px(self, corners: Points, way: Way) -> float:
        """Gives the change of the outline `corners` (4,), px, by the rolling shutter, by a speed that is not steady."""
        return 0.5 * way.unsteady_px_s * self._line_s * abs(complex(corners[2] - corners[0]))

    def settled(self, fit: Fit, way: Way) -> Fit:
        """Returns the fit with corners that agree with how this place, and with the shape that other places told."""
        if fit.edges is None:
            return fit
        slack_px = self.unsteady_px(fit.corners, way)
        recalled = self._shape_filter.recall(fit.corners, fit.edges, sigma_px=fit.sigma_px, way=way, slack_px=slack_px)
        if recalled is not None:
            return _agreed(fit, recalled)._replace(recalled=recalled.agrees)
        settled = self._shape_filter.settle(fit.corners, fit.edges, way=way, slack_px=slack_px)
        return fit if settled is None else _agreed(fit, settled)

    def compared(self, fit: Fit, way: Way) -> validation_gate.Verdict:
        """Gives the verdict on a fit by the outline of the last frames; one that has changed for long is the mark's."""
        compared = self._resting.departed(fit.by_edges.corners, way=way)
        if compared is None:
            return validation_gate.Verdict()
        arms, seen, way_px = compared
        departure = max(np.abs(seen - arms).tolist())
        limit = self._resting.limit_px(
            way_px=way_px,
            noise_px=noise_px(contrast=fit.contrast, blur_px=self.blur_px),
            sigma_px=fit.by_edges.worst_px,
            slack_px=self.unsteady_px(fit.corners, way),
        )
        if departure < limit:
            self._departed = 0
            return validation_gate.Verdict()
        self._departed += 1
        if self._departed > MOST_DEPARTED:
            self._forget_outline()
            return validation_gate.Verdict()
        lean = lean_of(arms, seen, limit_px=limit)
        if lean > 0:
            return validation_gate.Verdict(f"tipping: a lean of {degrees(lean):.0f} deg", lean)
        return validation_gate.Verdict(f"outline changed: by {departure:.2f} px, covered or in uneven light")

    def learn(self, fit: Fit, way: Way | None, *, same_path: bool) -> None:
        """Takes a fit that is believed, slowly. `way`: how the mark moves, None where no velocity is known.

        `same_path`: whether it was fitted with the path within the exposure that it has.
        """
        alone = fit.by_edges
        if not self._way_known(alone.corners, way):
            return
        moves = way or STILL
        at_once = unsheared(alone.corners, way=moves, line_s=self._line_s)
        seen = validation_gate.flat_shape(validation_gate.side_vectors(at_once, aspect=self._config.mark.aspect))
        if self.shape is None:
            self.shape = seen
        else:
            a, b, c = (old + LEARNING * (new - old) for old, new in zip(self.shape, seen, strict=True))
            self.shape = (a, b, c)
        self._resting.learn(alone.corners, way=moves, sigma_px=alone.worst_px)
        self._learn_shape(alone, moves)
        if same_path and (way is not None or self._config.shutter.exposure_ns == 0):
            self._learn_blur(fit, LEARNING if self.blur_known else 1.0)
            self.blur_known = True

    def learn_roughly(self, fit: Fit, way: Way | None) -> None:
        """Takes a fit whose edges are not told exactly enough."""
        alone = fit.by_edges
        if self._way_known(alone.corners, way):
            self._learn_shape(alone, way or STILL)
        if self.blur_known and fit.path_px == 0.0:
            self._learn_blur(fit, LEARNING)  # another lens may be at work

    def _way_known(self, corners: Points, way: Way | None) -> bool:
        """Returns true if what the rolling shutter makes of the outline is known."""
        return self._line_s == 0.0 or (way is not None and self.unsteady_px(corners, way) < STEADY_PX)

    def _learn_shape(self, alone: Fit, way: Way) -> None:
        if alone.edges is not None:
            noise = noise_px(contrast=alone.contrast, blur_px=self.blur_px)
            self._shape_filter.learn(alone.corners, sigma_px=alone.sigma_px, noise_px=noise, way=way)

    def _learn_blur(self, fit: Fit, share: float) -> None:
        self.blur_px += share * (sum(fit.blur_px.tolist()) / 4 - self.blur_px)


def _agreed(fit: Fit, settled: Settled) -> Fit:
    mean_px, worst_px = settled.mean_share * fit.sigma_px, settled.worst_share * fit.worst_px
    return fit._replace(corners=settled.corners, sigma_px=mean_px, worst_px=worst_px, alone=fit)

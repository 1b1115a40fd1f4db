"""The tracker: one frame after another in, one observation each out.

In steady state only pixels near the predicted outline are read. When that fails the edges are searched for in a wider
band, then about the last place, then the whole frame is looked through.
"""

from math import hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking import identity, validation_gate
from pi_agent.tracking.acquisition import MOST_PASSES, MOVES, NO_MARK, Acquisition, Attempt, inside
from pi_agent.tracking.config import TrackerConfig
from pi_agent.tracking.memory import Memory
from pi_agent.tracking.motion import Motion, Way, centre_of
from pi_agent.tracking.motion_blur import MotionBlur
from pi_agent.tracking.observation import Observation
from pi_agent.tracking.passes import Task
from pi_agent.tracking.pixels import PixelReader
from pi_agent.tracking.refine import Fit, refine, search_edges

Points = NDArray[np.complex128]
Frame = NDArray[np.uint8]

LEAST_BEND_PX = 0.003  # a smaller bend of the edges by the rolling shutter is left alone
FORGET_S = 0.5  # a plain square is the same quarter turn if it comes back within this time
SURE_S = 0.06  # within this time nothing turns by an eighth of a turn (360 degrees a second: 22 degrees)
UNSEEN_TURN_RAD_S = 1.7  # deviation of the yaw rate of a sliding block before it has been seen twice
OTHER_PATH_PX = 0.15  # a path within the exposure that differs so much from the expected one is fitted again
MOST_PATH_PX = 20.0  # a longer one is another mark's, or the same put down elsewhere
ON_THE_WAY_PX = 0.2  # sigma from which a fit has not come as far as the edges
KINKED = 0.0105  # error of an edge whose rows saw another speed each, in shares of what that makes of the outline
STILL_PX = 0.3, 0.6  # longest path within the exposure without motion blur: beside a textured plate, beside a margin
UNSEEN_LEAN_RAD = 0.2  # a smaller lean is hardly told
FASTEST_LEAN_RAD_S = 15.0  # a block that has just begun to tip is slower
LEAVES = validation_gate.Verdict("the mark leaves the frame")


class Tracker:
    """Follows one mark. `track` is called with every frame in order; it keeps no frame."""

    def __init__(self, config: TrackerConfig) -> None:
        self.config = config
        self._reader = PixelReader(config.tone.to_light_table())
        self._feature = identity.FeatureReader(config.mark)
        bare = config.mark.margin <= 0
        self._task = Task.beside(textured=bare, left_out=identity.notch_gap(config.mark))
        self._exposure_s = config.shutter.exposure_ns * 1e-9
        self.reset()

    def reset(self) -> None:
        """Forgets what was seen: the mark is acquired anew in the next frame."""
        self._motion = Motion()
        self._memory = Memory(self.config)
        self._acquisition = Acquisition(self.config, self._reader, self._feature, self._task)
        self._identity = ""
        self._lean_rad = 0.0

    def track(self, frame: Frame, *, capture_ns: int) -> Observation:
        """Finds the mark in a frame (height, width) uint8 captured at `capture_ns`."""
        self._reader.open(frame)
        time_s = capture_ns * 1e-9
        fit, verdict = self._follow(time_s)
        if _unusable(fit, verdict) and not verdict.rough:
            fit, verdict = self._acquisition.look(frame, verdict, blur_px=self._memory.blur_px)
            if fit is not None:
                fit, verdict = self._acquisition.without_notch(self._named(fit, time_s), verdict)
            if fit is not None:
                fit, verdict = self._with_motion_blur(fit, verdict, time_s)
        elif fit is not None and self._identity_unsure(time_s):
            fit = self._named(fit, time_s)
        if fit is not None and not verdict.reason:
            verdict = self._memory.compared(fit, self._motion.way_to(fit.corners, time_s))
        if fit is not None and not verdict.reason and self._speed_unsure(fit):
            verdict = MOVES
        if verdict.tip_rad > self._largest_lean(time_s):
            verdict = validation_gate.Verdict(
                "outline changed: faster than anything tips, so covered or in uneven light"
            )
        if fit is not None and verdict.rough:
            self._motion.update(fit.corners, time_s)  # near enough to know the speed by in the next frame
            self._memory.learn_roughly(fit, self._known_way())
        if fit is None or _unusable(fit, verdict):
            return Observation.missing(capture_ns, verdict.reason)
        return self._accept(fit, verdict, capture_ns)

    def _speed_unsure(self, fit: Fit) -> bool:
        """Returns true if texture is read through motion blur whose length only one step shows."""
        return not self._task.even and not self._motion.has_velocity and fit.path_px > validation_gate.MOTION_BLUR_PX

    def _largest_lean(self, time_s: float) -> float:
        """Returns the largest lean that a tipping block can have reached since the last frame."""
        gap_s = max(time_s - self._motion.time_s, 0.0)
        return max(self._lean_rad, UNSEEN_LEAN_RAD) + FASTEST_LEAN_RAD_S * gap_s

    def _follow(self, time_s: float) -> Attempt:
        """Finds the mark near its prediction, else near its last place."""
        predicted, last = self._motion.predict(time_s), self._motion.corners
        if predicted is None or last is None:
            return None, NO_MARK
        attempt = self._refined(predicted, time_s)
        for start in (predicted, last):
            if _near(*attempt):
                break
            near = search_edges(self._reader, start, reach_px=self.config.reach_px)
            if near is not None:
                attempt = self._refined(near, time_s)
        if attempt[0] is None and not inside(last, self._reader, clear_px=self.config.reach_px):
            return None, LEAVES
        return attempt

    def _refined(self, corners: Points, time_s: float) -> Attempt:
        """Returns the fit near the corners; once more when the mark has another speed than was expected."""
        if not inside(corners, self._reader):
            return None, LEAVES
        fit = self._fitted(corners, self._motion.expected_way(time_s), time_s)
        if fit is None:
            return None, NO_MARK
        return self._with_motion_blur(fit, self._verdict(fit, time_s), time_s)

    def _with_motion_blur(self, fit: Fit, verdict: validation_gate.Verdict, time_s: float) -> Attempt:
        """Returns the fit and its verdict, or new ones when the mark has another speed than was reckoned with."""
        way = self._motion.way_to(fit.corners, time_s)
        path_px = self._motion_blur_px(abs(way.velocity_px_s) * self._exposure_s)
        if abs(path_px - fit.path_px) < OTHER_PATH_PX or path_px > MOST_PATH_PX:
            return fit, verdict
        again = self._fitted(fit.corners, way, time_s)
        return (None, NO_MARK) if again is None else (again, self._verdict(again, time_s))

    def _verdict(self, fit: Fit, time_s: float) -> validation_gate.Verdict:
        way = self._motion.way_to(fit.corners, time_s)
        return validation_gate.verdict_on(fit, config=self.config, shape=self._memory.shape, way=way)

    def _fitted(self, corners: Points, way: Way, time_s: float) -> Fit | None:
        path = way.velocity_px_s * self._exposure_s
        motion_blur = None
        if self._motion_blur_px(abs(path)) > 0.0:
            motion_blur = MotionBlur(centre_of(corners), path, way.yaw_rate_rad_s * self._exposure_s)
        fit = refine(
            self._reader,
            corners,
            blur_px=np.full(4, self._memory.blur_px),
            task=self._task,
            most_passes=MOST_PASSES,
            blur_known=self._memory.blur_known,
            motion_blur=motion_blur,
            turn_per_row_rad=self._turn_per_row_rad(corners, way),
        )
        return None if fit is None else self._memory.settled(fit, self._motion.way_to(fit.corners, time_s))

    def _turn_per_row_rad(self, corners: Points, way: Way) -> float:
        """Gives the mark's turn from one row's exposure to the next, 0 where it bends no edge as far as can be seen."""
        turn = way.yaw_rate_rad_s * self.config.shutter.line_s
        diagonal = abs(complex(corners[2] - corners[0]))
        return turn if abs(turn) * diagonal**2 / 8 > LEAST_BEND_PX else 0.0

    def _path_px(self) -> float:
        """Returns the mark's path within the exposure, px; 0 where it is too short to blur."""
        return self._motion_blur_px(abs(self._motion.way.velocity_px_s) * self._exposure_s)

    def _motion_blur_px(self, path_px: float) -> float:
        return path_px if path_px >= STILL_PX[self._task.even] else 0.0

    def _identity_unsure(self, time_s: float) -> bool:
        """Returns true if continuity alone does not tell which corner is which.

        That is so after a gap, or before the mark was read.
        """
        unread = self.config.mark.feature != "none" and self._identity != "marked"
        return unread or time_s - self._motion.time_s > SURE_S

    def _named(self, fit: Fit, time_s: float) -> Fit:
        """Returns the same fit with its corners in the order of their identity, as far as that is known."""
        last = self._motion.corners
        turn = self._feature.turn(self._reader, fit.corners)
        if turn is not None:
            self._identity = "marked"
        elif last is None:
            turn, self._identity = 0, "continuous"
        else:
            step = 1 if self.config.mark.aspect == 1.0 else 2
            turn = identity.nearest_turn(fit.corners - fit.corners.mean(), last - last.mean(), step=step)
            if time_s - self._motion.time_s > FORGET_S:
                self._identity = "assumed"
        return fit if turn == 0 else _turned(fit, turn)

    def _accept(self, fit: Fit, verdict: validation_gate.Verdict, capture_ns: int) -> Observation:
        self._motion.update(fit.corners, capture_ns * 1e-9)
        self._lean_rad = verdict.tip_rad
        first = not self._motion.has_velocity
        self._acquisition.found()
        if not verdict.reason:
            same_path = abs(fit.path_px - self._path_px()) < OTHER_PATH_PX
            self._memory.learn(fit, self._known_way(), same_path=same_path)
        corners = fit.corners.view(np.float64).reshape(4, 2)
        shutter = self.config.shutter
        unsteady_px = self._memory.unsteady_px(fit.corners, self._motion.way)
        a, b, c, d = (round(shutter.row0_dt_ns + row * shutter.line_ns) for row in corners[:, 1].tolist())
        return Observation(
            capture_ns=capture_ns,
            found=True,
            reason=verdict.reason,
            corners_px=corners,
            sigma_px=hypot(fit.sigma_px, self._unseen_turn_px(fit, first), KINKED * unsteady_px),
            residual_px=fit.residual_px,
            corner_dt_ns=(a, b, c, d),
            identity=self._identity,
            tip_rad=verdict.tip_rad,
        )

    def _known_way(self) -> Way | None:
        """Returns the motion of the mark in the last frame; None at acquisition."""
        return self._motion.way if self._motion.has_velocity else None

    def _unseen_turn_px(self, fit: Fit, first: bool) -> float:
        """Gives the part of sigma, px, by the edges' bend under an unknown turn, when a mark is acquired in motion."""
        line_s = self.config.shutter.line_s
        if (
            not first
            or line_s == 0
            or self._acquisition.unknown_path_px(fit, blur_px=self._memory.blur_px) < validation_gate.MOTION_BLUR_PX
        ):
            return 0.0
        # An edge of length L bows from its corners by a fourth of the turn from row to row, times L² and its slope; the
        # line through it lies two thirds of that off. Two edges, one as steep as the other is level, move a corner.
        diagonal = abs(complex(fit.corners[2] - fit.corners[0]))
        return UNSEEN_TURN_RAD_S * line_s * diagonal**2 / (12.0 * sqrt(2.0))


def _unusable(fit: Fit | None, verdict: validation_gate.Verdict) -> bool:
    return fit is None or (verdict.reason != "" and not verdict.tip_rad)


def _near(fit: Fit | None, verdict: validation_gate.Verdict) -> bool:
    """Returns true if an attempt began near enough to the mark to have ended on it.

    From two blurs away, where a block that has just begun to slide may lie, a fit can settle on the way there: what it
    takes for the edge is nothing like one, and its sigma says so.
    """
    return fit is not None and (not verdict.reason or (verdict.rough and fit.by_edges.worst_px < ON_THE_WAY_PX))


def _turned(fit: Fit, turn: int) -> Fit:
    return fit._replace(
        corners=np.roll(fit.corners, -turn),
        alone=None if fit.alone is None else _turned(fit.alone, turn),
        agreement=np.roll(fit.agreement, -turn),
        blur_px=np.roll(fit.blur_px, -turn),
    )

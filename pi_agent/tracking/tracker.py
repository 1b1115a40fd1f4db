"""The tracker: one frame after another in, one observation each out.

In steady state only pixels near the predicted outline are read. When that fails the edges are searched for in a wider
band, then about the last place, then the whole frame is looked through.
"""

from math import degrees, hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking import identity, judge
from pi_agent.tracking.acquire import candidates
from pi_agent.tracking.config import TrackerConfig
from pi_agent.tracking.known_shape import KnownShape, Settled
from pi_agent.tracking.lines import EdgeVariance
from pi_agent.tracking.motion import STILL, Motion, Way, centre_of, unsheared
from pi_agent.tracking.observation import Observation
from pi_agent.tracking.passes import Task
from pi_agent.tracking.pixels import PixelReader
from pi_agent.tracking.refine import Fit, refine, search_edges
from pi_agent.tracking.resting import NEAR_ON_GRAIN_PX, NEAR_PX, NOISE_PX, RestingShape, lean_of
from pi_agent.tracking.smear import Smear

Points = NDArray[np.complex128]
Frame = NDArray[np.uint8]
Attempt = tuple[Fit | None, judge.Verdict]
Seen = tuple[Fit, judge.Verdict]

MOST_PASSES = 5
LEAST_BEND_PX = 0.003  # a smaller bend of the edges by the rolling shutter is left alone
LEARNING = 0.05  # share of the newest frame in the blur and the shape that are remembered
FORGET_S = 0.5  # a plain square is the same quarter turn if it comes back within this time
SURE_S = 0.06  # within this time nothing turns by an eighth of a turn (360 degrees a second: 22 degrees)
UNSEEN_TURN_RAD_S = 1.7  # deviation of the yaw rate of a sliding block before it has been seen twice
OTHER_PATH_PX = 0.15  # a path within the exposure that differs so much from the expected one is fitted again
MOST_PATH_PX = 20.0  # a longer one is another mark's, or the same put down elsewhere
SMEAR_AT_SIGHT_PX = 0.9  # a path within the exposure that a first sight shows by its blur
ON_THE_WAY_PX = 0.2  # sigma from which a fit has not come as far as the edges
STEADY_PX = 0.03  # what a speed that is not steady may make of an outline that is learned
KINKED = 0.0105  # what an edge is off whose rows saw another speed each, in shares of what that makes of the outline
STILL_PX = 0.3, 0.6  # a path within the exposure that is no smear: beside a textured plate, and beside a margin
UNSEEN_LEAN_RAD = 0.2  # a smaller lean is hardly told
FASTEST_LEAN_RAD_S = 15.0  # a block that has just begun to tip is slower
DETECT_EVERY = 10  # frames without an outline from one call of OpenCV's tag detector to the next
MOST_DEPARTED = 45  # frames after which a changed outline is the mark's: half a second at 90 Hz
NO_MARK = judge.Verdict("no mark in this frame")
SMEARED = judge.Verdict("smeared: the mark moves, and how fast is not known at first sight", rough=True)
LEAVES = judge.Verdict("the mark leaves the frame")


class Tracker:
    """Follows one mark. `track` is called with every frame in order; it keeps no frame."""

    def __init__(self, config: TrackerConfig) -> None:
        self.config = config
        self._reader = PixelReader(config.tone.to_light_table())
        self._feature = identity.FeatureReader(config.mark)
        bare = config.mark.margin <= 0
        self._task = Task.beside(textured=bare, left_out=identity.notch_gap(config.mark))
        self._first_task = Task.beside(textured=bare)
        self._exposure_s = config.shutter.exposure_ns * 1e-9
        self.reset()

    def reset(self) -> None:
        """Forgets what was seen: the next frame is a first sight."""
        self._motion = Motion()
        self._forget_outline()
        self._blur_px = self.config.blur_px
        self._blur_known = False
        self._shape: judge.Shape | None = None
        self._identity = ""
        self._dropout = 0
        self._lean_rad = 0.0

    def track(self, frame: Frame, *, capture_ns: int) -> Observation:
        """The mark in a frame (height, width) uint8 captured at `capture_ns`."""
        self._reader.open(frame)
        time_s = capture_ns * 1e-9
        fit, verdict = self._follow(time_s)
        if _unusable(fit, verdict) and not verdict.rough:
            fit, verdict = self._acquire(frame, time_s, verdict)
            if fit is not None:
                fit, verdict = self._with_smear(fit, verdict, time_s)
        elif fit is not None and self._doubtful(time_s):
            fit = self._named(fit, time_s)
        if fit is not None and not verdict.reason:
            verdict = self._at_rest(fit, verdict, time_s)
        if fit is not None and not verdict.reason and self._speed_unsure(fit):
            verdict = SMEARED
        if verdict.tip_rad > self._largest_lean(time_s):
            verdict = judge.Verdict("outline changed: faster than anything tips, so covered or in uneven light")
        if fit is not None and verdict.rough:
            self._motion.update(fit.corners, time_s)  # near enough to know the speed by in the next frame
            self._learn_shape(fit.by_edges)
            if self._blur_known and fit.path_px == 0.0:
                self._blur_px += LEARNING * (
                    sum(fit.blur_px.tolist()) / 4 - self._blur_px
                )  # or another lens is at work
        if fit is None or _unusable(fit, verdict):
            return Observation.missing(capture_ns, verdict.reason)
        return self._accept(fit, verdict, capture_ns)

    def _speed_unsure(self, fit: Fit) -> bool:
        """Whether grain is read through a smear of which one step alone tells how long it is."""
        return not self._task.even and not self._motion.has_velocity and fit.path_px > SMEAR_AT_SIGHT_PX

    def _at_rest(self, fit: Fit, verdict: judge.Verdict, time_s: float) -> judge.Verdict:
        """The verdict when the outline is compared with that of the last frames."""
        way = self._motion.way_to(fit.corners, time_s)
        compared = self._resting.departed(fit.by_edges.corners, way=way)
        if compared is None:
            return verdict
        arms, seen, way_px = compared
        departure = max(np.abs(seen - arms).tolist())
        limit = self._resting.limit_px(
            way_px=way_px,
            contrast=fit.contrast,
            sigma_px=fit.by_edges.worst_px,
            slack_px=self._unsteady_px(fit.corners, way),
        )
        if departure < limit:
            self._departed = 0
            return verdict
        self._departed += 1
        if self._departed > MOST_DEPARTED:
            self._forget_outline()
            return verdict
        lean = lean_of(arms, seen, limit_px=limit)
        if lean > 0:
            return judge.Verdict(f"tipping: a lean of {degrees(lean):.0f} deg", lean)
        return judge.Verdict(f"outline changed: by {departure:.2f} px, covered or in uneven light")

    def _largest_lean(self, time_s: float) -> float:
        """The largest lean that a tipping block can have reached since the last frame."""
        gap_s = max(time_s - self._motion.time_s, 0.0)
        return max(self._lean_rad, UNSEEN_LEAN_RAD) + FASTEST_LEAN_RAD_S * gap_s

    def _forget_outline(self) -> None:
        near_px, line_s = NEAR_ON_GRAIN_PX if self.config.mark.margin <= 0 else NEAR_PX, self.config.shutter.line_s
        self._resting = RestingShape(near_px=near_px, line_s=line_s)
        self._departed = 0
        self._known = KnownShape(line_s=line_s)

    def _follow(self, time_s: float) -> Attempt:
        """The mark near its prediction, else near its last place."""
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
        if attempt[0] is None and not _inside(last, self._reader, clear_px=self.config.reach_px):
            return None, LEAVES
        return attempt

    def _refined(self, corners: Points, time_s: float) -> Attempt:
        """The fit near the corners; once more when the mark has another speed than was expected."""
        if not _inside(corners, self._reader):
            return None, LEAVES
        fit = self._fitted(corners, self._motion.expected_way(time_s), time_s)
        if fit is None:
            return None, NO_MARK
        return self._with_smear(fit, self._judged(fit, time_s), time_s)

    def _with_smear(self, fit: Fit, verdict: judge.Verdict, time_s: float) -> Attempt:
        """The fit and its verdict, or new ones when the mark has another speed than was reckoned with."""
        way = self._motion.way_to(fit.corners, time_s)
        path_px = self._smeared_px(abs(way.velocity_px_s) * self._exposure_s)
        if abs(path_px - fit.path_px) < OTHER_PATH_PX or path_px > MOST_PATH_PX:
            return fit, verdict
        again = self._fitted(fit.corners, way, time_s)
        return (None, NO_MARK) if again is None else (again, self._judged(again, time_s))

    def _judged(self, fit: Fit, time_s: float) -> judge.Verdict:
        return judge.judge(fit, config=self.config, shape=self._shape, way=self._motion.way_to(fit.corners, time_s))

    def _fitted(self, corners: Points, way: Way, time_s: float) -> Fit | None:
        path = way.velocity_px_s * self._exposure_s
        smear = None
        if self._smeared_px(abs(path)) > 0.0:
            smear = Smear(centre_of(corners), path, way.yaw_rate_rad_s * self._exposure_s)
        fit = refine(
            self._reader,
            corners,
            blur_px=np.full(4, self._blur_px),
            task=self._task,
            most_passes=MOST_PASSES,
            blur_known=self._blur_known,
            smear=smear,
            turn_per_row_rad=self._turn_per_row_rad(corners, way),
        )
        if fit is None or fit.edges is None:
            return fit
        return self._settled(fit, fit.edges, self._motion.way_to(fit.corners, time_s))

    def _settled(self, fit: Fit, variance: EdgeVariance, way: Way) -> Fit:
        """The fit with corners that agree with how this place, and with the shape that other places told."""
        slack_px = self._unsteady_px(fit.corners, way)
        recalled = self._known.recall(fit.corners, variance, sigma_px=fit.sigma_px, way=way, slack_px=slack_px)
        if recalled is not None:
            return _agreed(fit, recalled)._replace(recalled=recalled.agrees)
        settled = self._known.settle(fit.corners, variance, way=way, slack_px=slack_px)
        return fit if settled is None else _agreed(fit, settled)

    def _unsteady_px(self, corners: Points, way: Way) -> float:
        """What the rolling shutter may make of the shape by a speed that is not steady."""
        return 0.5 * way.unsteady_px_s * self.config.shutter.line_s * abs(complex(corners[2] - corners[0]))

    def _turn_per_row_rad(self, corners: Points, way: Way) -> float:
        """The mark's turn from one row's exposure to the next, 0 where it bends no edge as far as can be seen."""
        turn = way.yaw_rate_rad_s * self.config.shutter.line_s
        diagonal = abs(complex(corners[2] - corners[0]))
        return turn if abs(turn) * diagonal**2 / 8 > LEAST_BEND_PX else 0.0

    def _path_px(self) -> float:
        """The mark's path within the exposure, as far as it is a smear."""
        return self._smeared_px(abs(self._motion.way.velocity_px_s) * self._exposure_s)

    def _smeared_px(self, path_px: float) -> float:
        return path_px if path_px >= STILL_PX[self._task.even] else 0.0

    def _acquire(self, frame: Frame, time_s: float, why: judge.Verdict) -> Attempt:
        """The mark anywhere in the frame (or the region): the candidate that is believed, when it is the only one."""
        left, top, width, height = self.config.region_px or (0, 0, frame.shape[1], frame.shape[0])
        part = frame[max(top, 0) : top + height, max(left, 0) : left + width]
        origin = complex(max(left, 0), max(top, 0))
        believed: list[Seen] = []
        quads = candidates(part, side_px=self.config.side_px, aspect=self.config.mark.aspect)
        for quad in quads or self._tag_outline(part):
            fit, verdict = self._first_sight(quad + origin)
            if fit is not None and (not verdict.reason or verdict.rough):
                believed.append((fit, verdict))
            elif fit is not None:
                why = verdict
        return self._only_one(believed, time_s) if believed else (None, why)

    def _tag_outline(self, part: Frame) -> list[Points]:
        """The tag by OpenCV's detector, when no outline stands alone: slow, so not in every frame of a dropout."""
        if self.config.mark.feature != "tag":
            return []
        self._dropout += 1
        quad = identity.detect_tag(part, self.config.mark) if self._dropout % DETECT_EVERY == 1 else None
        return [] if quad is None else [quad]

    def _first_sight(self, quad: Points) -> Attempt:
        near = search_edges(self._reader, quad, reach_px=5)
        if near is None or not _inside(near, self._reader):
            return None, NO_MARK
        near = np.roll(near, -identity.first_turn(near, aspect=self.config.mark.aspect))
        blur = np.full(4, self._blur_px)
        fit = refine(self._reader, near, blur_px=blur, task=self._first_task, most_passes=MOST_PASSES)
        if fit is None:
            return None, NO_MARK
        verdict = judge.judge(fit, config=self.config, shape=None, way=STILL)
        if not verdict.reason and not self._task.even and self._unknown_path_px(fit) > SMEAR_AT_SIGHT_PX:
            verdict = SMEARED
        return fit, verdict

    def _only_one(self, believed: list[Seen], time_s: float) -> Attempt:
        if self.config.mark.feature != "none":
            believed = [pair for pair in believed if self._feature.turn(self._reader, pair[0].corners) is not None]
        if len(believed) == 1:
            fit, verdict = believed[0]
            return self._without_notch(self._named(fit, time_s), verdict)
        if not believed:
            return None, judge.Verdict("a mark, but its feature cannot be read")
        return None, judge.Verdict("two marks in this frame: cover one, or set the mark's size")

    def _without_notch(self, named: Fit, verdict: judge.Verdict) -> Attempt:
        """The first sight once more when it has told where the notch is: no edge is seen in part for that."""
        if self._task.left_out is None or verdict.reason:
            return named, verdict
        again = refine(self._reader, named.corners, blur_px=named.blur_px, task=self._task, most_passes=MOST_PASSES)
        if again is None:
            return None, NO_MARK
        return again, judge.judge(again, config=self.config, shape=None, way=STILL)

    def _doubtful(self, time_s: float) -> bool:
        """Whether continuity alone does not tell which corner is which: after a gap, or before the mark was read."""
        unread = self.config.mark.feature != "none" and self._identity != "marked"
        return unread or time_s - self._motion.time_s > SURE_S

    def _named(self, fit: Fit, time_s: float) -> Fit:
        """The same fit with its corners in the order of their identity, as far as that is known."""
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

    def _accept(self, fit: Fit, verdict: judge.Verdict, capture_ns: int) -> Observation:
        self._motion.update(fit.corners, capture_ns * 1e-9)
        self._lean_rad = verdict.tip_rad
        first = not self._motion.has_velocity
        self._dropout = 0
        if not verdict.reason:
            self._learn(fit)
        corners = fit.corners.view(np.float64).reshape(4, 2)
        shutter = self.config.shutter
        unsteady_px = self._unsteady_px(fit.corners, self._motion.way)
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

    def _unseen_turn_px(self, fit: Fit, first: bool) -> float:
        """What the bend of the edges by an unknown turn adds to sigma, when the first sight is of a smeared mark."""
        line_s = self.config.shutter.line_s
        if not first or line_s == 0 or self._unknown_path_px(fit) < SMEAR_AT_SIGHT_PX:
            return 0.0
        # An edge of length L bows from its corners by a fourth of the turn from row to row, times L² and its slope; the
        # line through it lies two thirds of that off. Two edges, one as steep as the other is level, move a corner.
        diagonal = abs(complex(fit.corners[2] - fit.corners[0]))
        return UNSEEN_TURN_RAD_S * line_s * diagonal**2 / (12.0 * sqrt(2.0))

    def _unknown_path_px(self, fit: Fit) -> float:
        """The path within the exposure that would make the lens's blur the one that was found."""
        if self._exposure_s == 0:
            return 0.0
        lens = min(self._blur_px, float(fit.blur_px.min()))
        return sqrt(max(12.0 * (float(np.mean(fit.blur_px**2)) - lens**2), 0.0))

    def _learn(self, fit: Fit) -> None:
        """Remembers the lens's blur and the mark's flat shape, slowly."""
        alone = fit.by_edges
        if not self._motion_known(alone.corners):
            return
        at_once = unsheared(alone.corners, way=self._motion.way, line_s=self.config.shutter.line_s)
        seen = judge.flat_shape(judge.side_vectors(at_once, aspect=self.config.mark.aspect))
        if self._shape is None:
            self._shape = seen
        else:
            a, b, c = (old + LEARNING * (new - old) for old, new in zip(self._shape, seen, strict=True))
            self._shape = (a, b, c)
        self._resting.learn(alone.corners, way=self._motion.way, sigma_px=alone.worst_px)
        self._learn_shape(alone)
        if abs(fit.path_px - self._path_px()) < OTHER_PATH_PX and (
            self._motion.has_velocity or self.config.shutter.exposure_ns == 0
        ):
            share = LEARNING if self._blur_known else 1.0
            self._blur_px += share * (sum(fit.blur_px.tolist()) / 4 - self._blur_px)
            self._blur_known = True

    def _motion_known(self, corners: Points) -> bool:
        """Whether what the rolling shutter makes of the mark's shape is known: not at first sight, nor in a blow."""
        if self.config.shutter.line_ns == 0:
            return True
        return self._motion.has_velocity and self._unsteady_px(corners, self._motion.way) < STEADY_PX

    def _learn_shape(self, alone: Fit) -> None:
        if alone.edges is not None and self._motion_known(alone.corners):
            noise_px = NOISE_PX / alone.contrast
            self._known.learn(alone.corners, sigma_px=alone.sigma_px, noise_px=noise_px, way=self._motion.way)


def _unusable(fit: Fit | None, verdict: judge.Verdict) -> bool:
    return fit is None or (verdict.reason != "" and not verdict.tip_rad)


def _near(fit: Fit | None, verdict: judge.Verdict) -> bool:
    """Whether an attempt began near enough to the mark to have ended on it.

    From two blurs away, where a block that has just begun to slide may lie, a fit can settle on the way there: what it
    takes for the edge is nothing like one, and its sigma says so.
    """
    return fit is not None and (not verdict.reason or (verdict.rough and fit.by_edges.worst_px < ON_THE_WAY_PX))


def _agreed(fit: Fit, settled: Settled) -> Fit:
    mean_px, worst_px = settled.mean_share * fit.sigma_px, settled.worst_share * fit.worst_px
    return fit._replace(corners=settled.corners, sigma_px=mean_px, worst_px=worst_px, alone=fit)


def _inside(corners: Points, reader: PixelReader, *, clear_px: int = 2) -> bool:
    x, y = corners.real.tolist(), corners.imag.tolist()
    right, bottom = reader.width - 1 - clear_px, reader.height - 1 - clear_px
    return bool(min(x) > clear_px and min(y) > clear_px and max(x) < right and max(y) < bottom)


def _turned(fit: Fit, turn: int) -> Fit:
    return fit._replace(
        corners=np.roll(fit.corners, -turn),
        alone=None if fit.alone is None else _turned(fit.alone, turn),
        agreement=np.roll(fit.agreement, -turn),
        blur_px=np.roll(fit.blur_px, -turn),
    )

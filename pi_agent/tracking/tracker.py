"""The tracker: one frame after another in, one observation each out.

In steady state only pixels near the predicted outline are read. When that fails the edges are searched for in a wider
band, then about the last place, then the whole frame is looked through.
"""

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking import identity, judge
from pi_agent.tracking.acquire import candidates
from pi_agent.tracking.config import TrackerConfig
from pi_agent.tracking.motion import Motion
from pi_agent.tracking.observation import Observation
from pi_agent.tracking.pixels import PixelReader
from pi_agent.tracking.refine import Fit, refine, search_edges

Floats = NDArray[np.float64]
Frame = NDArray[np.uint8]

PASSES = 2  # in steady state; a search is followed by one more
LEARNING = 0.05  # share of the newest frame in the blur and the shape that are remembered
FORGET_S = 0.5  # a plain square is the same quarter turn if it comes back within this time


class Tracker:
    """Follows one mark. `track` is called with every frame in order; it keeps no frame."""

    def __init__(self, config: TrackerConfig) -> None:
        self.config = config
        self._reader = PixelReader(config.tone.to_light_table())
        self._feature = identity.FeatureReader(config.mark)
        self._gap = identity.notch_gap(config.mark)
        self.reset()

    def reset(self) -> None:
        """Forgets what was seen: the next frame is a first sight."""
        self._motion = Motion()
        self._blur_px = self.config.blur_px
        self._shape: Floats | None = None
        self._identity = ""

    def track(self, frame: Frame, *, capture_ns: int) -> Observation:
        """The mark in a frame (height, width) uint8 captured at `capture_ns`."""
        self._reader.open(frame)
        time_s = capture_ns * 1e-9
        fit, verdict = self._follow(time_s)
        if fit is None or (verdict.reason and not verdict.tip_rad):
            fit, verdict = self._acquire(frame, time_s, verdict)
        if fit is None or (verdict.reason and not verdict.tip_rad):
            return Observation.missing(capture_ns, verdict.reason)
        return self._accept(fit, verdict, capture_ns)

    def _follow(self, time_s: float) -> tuple[Fit | None, judge.Verdict]:
        """The mark near its prediction, else near its last place."""
        predicted = self._motion.predict(time_s)
        nothing = judge.Verdict("no mark in this frame")
        if predicted is None or self._shape is None:
            return None, nothing
        fit, verdict = self._refined(predicted, searched=False)
        if fit is not None and not verdict.reason:
            return fit, verdict
        last = self._motion.corners
        for start in (predicted, last):
            near = None if start is None else search_edges(self._reader, start, reach_px=self.config.reach_px)
            if near is None:
                continue
            fit, verdict = self._refined(near, searched=True)
            if fit is not None and not verdict.reason:
                return fit, verdict
        return fit, verdict

    def _refined(self, corners: Floats, *, searched: bool) -> tuple[Fit | None, judge.Verdict]:
        if not _inside(corners, self._reader):
            return None, judge.Verdict("the mark leaves the frame")
        fit = refine(
            self._reader,
            corners,
            blur_px=self._expected_blur(corners),
            passes=PASSES + int(searched),
            vote_first=True,
            left_out=self._gap,
        )
        if fit is None:
            return None, judge.Verdict("no mark in this frame")
        return fit, judge.judge(fit, config=self.config, shape=self._shape, shear=self._shear())

    def _expected_blur(self, corners: Floats) -> Floats:
        """The lens's blur and the motion's, across each edge (4,)."""
        step = np.roll(corners, -1, axis=0) - corners
        normal = np.stack([step[:, 1], -step[:, 0]], axis=1) / np.hypot(step[:, 0], step[:, 1])[:, None]
        path = np.sum(normal * self._motion.velocity_px_s, axis=1) * self.config.shutter.exposure_ns * 1e-9
        return np.sqrt(self._blur_px**2 + path**2 / 12.0)

    def _shear(self) -> float:
        return float(self._motion.velocity_px_s[0]) * self.config.shutter.line_s

    def _acquire(self, frame: Frame, time_s: float, why: judge.Verdict) -> tuple[Fit | None, judge.Verdict]:
        """The mark anywhere in the frame (or the region): the candidate that is believed, when it is the only one."""
        left, top, width, height = self.config.region_px or (0, 0, frame.shape[1], frame.shape[0])
        part = frame[max(top, 0) : top + height, max(left, 0) : left + width]
        origin = np.array([max(left, 0), max(top, 0)], dtype=np.float64)
        believed: list[tuple[Fit, judge.Verdict]] = []
        for quad in candidates(part, side_px=self.config.side_px, aspect=self.config.mark.aspect):
            fit, verdict = self._first_sight(quad + origin)
            if fit is not None and not verdict.reason:
                believed.append((fit, verdict))
            elif fit is not None:
                why = verdict
        return self._only_one(believed, time_s) if believed else (None, why)

    def _first_sight(self, quad: Floats) -> tuple[Fit | None, judge.Verdict]:
        nothing = judge.Verdict("no mark in this frame")
        near = search_edges(self._reader, quad, reach_px=5)
        if near is None or not _inside(near, self._reader):
            return None, nothing
        turn = identity.first_turn(near, aspect=self.config.mark.aspect)
        blur = np.full(4, self._blur_px)
        fit = refine(self._reader, np.roll(near, -turn, axis=0), blur_px=blur, passes=3, vote_first=True, left_out=None)
        if fit is None:
            return None, nothing
        return fit, judge.judge(fit, config=self.config, shape=None, shear=0.0)

    def _only_one(self, believed: list[tuple[Fit, judge.Verdict]], time_s: float) -> tuple[Fit | None, judge.Verdict]:
        marked = [(fit, v) for fit, v in believed if self._feature.turn(self._reader, fit.corners) is not None]
        if self.config.mark.feature != "none":
            believed = marked
        if len(believed) == 1:
            fit, verdict = believed[0]
            return self._named(fit, time_s), verdict
        if not believed:
            return None, judge.Verdict("a mark, but its feature cannot be read")
        return None, judge.Verdict("two marks in this frame: cover one, or set the mark's size")

    def _named(self, fit: Fit, time_s: float) -> Fit:
        """The same fit with its corners in the order of their identity, as far as that is known."""
        last = self._motion.corners
        aspect = self.config.mark.aspect
        turn = self._feature.turn(self._reader, fit.corners)
        if turn is not None:
            self._identity = "marked"
        elif last is not None:
            turn = identity.nearest_turn(
                fit.corners - fit.corners.mean(axis=0), last - last.mean(axis=0), step=1 if aspect == 1.0 else 2
            )
            recent = time_s - self._motion.time_s < FORGET_S
            self._identity = self._identity if recent else "assumed"
        else:
            turn = 0
            self._identity = "continuous"
        self._shape = None
        return fit if turn == 0 else _turned(fit, turn)

    def _accept(self, fit: Fit, verdict: judge.Verdict, capture_ns: int) -> Observation:
        corners = fit.corners
        self._motion.update(corners, capture_ns * 1e-9)
        if not verdict.reason:
            self._learn(fit)
        times = self.config.shutter.dt_s(corners[:, 1]) * 1e9
        return Observation(
            capture_ns=capture_ns,
            found=not verdict.reason,
            reason=verdict.reason,
            corners_px=corners,
            sigma_px=fit.sigma_px,
            residual_px=fit.residual_px,
            corner_dt_ns=(round(times[0]), round(times[1]), round(times[2]), round(times[3])),
            identity=self._identity,
            tip_rad=verdict.tip_rad,
        )

    def _learn(self, fit: Fit) -> None:
        """Remembers the lens's blur and the mark's flat shape, slowly."""
        matrix = judge.sides_matrix(fit.corners, aspect=self.config.mark.aspect, shear=self._shear())
        gram = matrix.T @ matrix
        root = np.linalg.cholesky(gram).T
        if self._shape is None:
            self._shape, share = root, 0.5
        else:
            self._shape, share = self._shape + LEARNING * (root - self._shape), LEARNING
        if float(np.sum(self._motion.velocity_px_s**2)) * self.config.shutter.exposure_ns**2 < 1e16:
            self._blur_px += share * (float(fit.blur_px.mean()) - self._blur_px)


def _inside(corners: Floats, reader: PixelReader) -> bool:
    x, y = corners[:, 0], corners[:, 1]
    return bool(x.min() > 2 and y.min() > 2 and x.max() < reader.width - 3 and y.max() < reader.height - 3)


def _turned(fit: Fit, turn: int) -> Fit:
    return Fit(
        corners=np.roll(fit.corners, -turn, axis=0),
        sigma_px=fit.sigma_px,
        residual_px=fit.residual_px,
        agreement=np.roll(fit.agreement, -turn),
        contrast=fit.contrast,
        blur_px=np.roll(fit.blur_px, -turn),
        saturated=fit.saturated,
    )

"""Errors of a method over many trials, and the figures that are asked about them."""

from dataclasses import dataclass, field
from time import perf_counter

import numpy as np
from numpy.typing import NDArray
from scipy.stats import beta

from pi_agent.tracking.tracker import Tracker
from tests.benchmarks.tracking_rivals.conditions import Maker, Trial

Floats = NDArray[np.float64]

WRONG_PX = 0.15  # a reported corner further off is wrong, whatever sigma was said
CONFIDENCE = 0.95


@dataclass
class Scores:
    """Corner errors (n, 4, 2) and their sigmas, frames without an answer, reasons, milliseconds."""

    errors: list[Floats] = field(default_factory=list)
    sigmas: list[float] = field(default_factory=list)
    outwards: list[float] = field(default_factory=list)
    missed: int = 0
    reasons: dict[str, int] = field(default_factory=dict)
    milliseconds: list[float] = field(default_factory=list)

    def miss(self, reason: str) -> None:
        """Counts a frame that was declared to hold no mark."""
        self.missed += 1
        kind = reason.partition(":")[0]
        self.reasons[kind] = self.reasons.get(kind, 0) + 1

    def add(self, error: Floats, truth: Floats, sigma: float) -> None:
        """Counts a frame whose corners were reported."""
        arm = truth - truth.mean(axis=0)
        self.errors.append(error)
        self.sigmas.append(sigma)
        self.outwards.append(float(np.mean(np.sum(error * arm, axis=1) / np.linalg.norm(arm, axis=1))))

    @property
    def frames(self) -> int:
        """All frames."""
        return len(self.errors) + self.missed

    @property
    def rms_px(self) -> float:
        """Root mean square distance of the corners from the truth."""
        return float(np.sqrt(np.mean(np.sum(np.array(self.errors) ** 2, axis=2)))) if self.errors else float("nan")

    @property
    def radial_px(self) -> float:
        """Mean error away from the mark's centre: above 0, the mark is seen too large."""
        return float(np.mean(self.outwards)) if self.outwards else float("nan")

    @property
    def missed_percent(self) -> float:
        """Frames without an answer."""
        return 100.0 * self.missed / self.frames

    @property
    def wrong(self) -> int:
        """Frames reported with a corner that is more than WRONG_PX off."""
        return int(sum(float(np.linalg.norm(error, axis=1).max()) > WRONG_PX for error in self.errors))

    @property
    def normalised_variance(self) -> float:
        """Mean square of error over sigma, by coordinate: 1 when sigma is true."""
        if not self.errors:
            return float("nan")
        return float(np.mean(np.array(self.errors) ** 2 / np.array(self.sigmas)[:, None, None] ** 2))

    def line(self, name: str) -> str:
        """One row of the table; see `HEAD`."""
        time = min(self.milliseconds) if self.milliseconds else float("nan")
        worst = max((float(np.linalg.norm(e, axis=1).max()) for e in self.errors), default=float("nan"))
        return (
            f"{name:26s} {self.frames:6d} {self.rms_px:8.4f} {self.radial_px:+8.4f} {worst:7.3f} "
            f"{100.0 - self.missed_percent:7.2f} {self.wrong:6d} {1000 * upper_share(self.wrong, self.frames):6.2f} "
            f"{self.normalised_variance:7.2f} {time:7.2f} "
            f"{np.median(self.milliseconds) if self.milliseconds else float('nan'):7.2f}  "
            + ", ".join(f"{kind} {count}" for kind, count in self.reasons.items())
        )


HEAD = (
    f"{'condition':26s} {'frames':>6s} {'rms px':>8s} {'radial':>8s} {'worst':>7s} {'found %':>7s} {'wrong':>6s} "
    f"{'‰ below':>6s} {'norm.var':>7s} {'ms min':>7s} {'ms med':>7s}  reasons"
)
"""`‰ below`: the share of wrong frames lies below, with 95 % confidence."""


def upper_share(count: int, frames: int) -> float:
    """Clopper and Pearson's upper bound (exact, one-sided, 95 %) of a share of which `count` of `frames` were seen."""
    return float(beta.ppf(CONFIDENCE, count + 1, frames - count)) if count < frames else 1.0


def lower_share(count: int, frames: int) -> float:
    """Clopper and Pearson's lower bound (exact, one-sided, 95 %)."""
    return float(beta.ppf(1.0 - CONFIDENCE, count, frames - count + 1)) if count else 0.0


def aligned(corners: Floats, truth: Floats) -> Floats:
    """The error of each corner, with the corners in the order that fits best (for methods without identity)."""
    turns = (np.roll(corners, -turn, axis=0) - truth for turn in range(4))
    return min(turns, key=lambda error: float(np.sum(error**2)))


def measure(maker: Maker, *, trials: int, seed: int) -> tuple[Scores, Scores]:
    """Our tracker over many trials: at acquisition of the last frame, and following up to it."""
    first, followed = Scores(), Scores()
    for number in range(trials):
        measure_one(maker, seed=seed, number=number, first=first, followed=followed)
    return first, followed


def measure_one(maker: Maker, *, seed: int, number: int, first: Scores, followed: Scores) -> None:
    """Counts one trial in both scores."""
    trial = maker(np.random.default_rng([seed, number]))
    last = len(trial.frames) - 1
    _count(first, Tracker(trial.config), trial, last)
    tracker = Tracker(trial.config)
    for earlier in range(last):
        tracker.track(trial.frames[earlier], capture_ns=trial.capture_ns(earlier))
    _count(followed, tracker, trial, last)


def measure_slide(trial: Trial, scores: Scores) -> None:
    """Counts every frame of a trial from the third on, before which no speed is known."""
    tracker = Tracker(trial.config)
    for number, frame in enumerate(trial.frames):
        if number < 2:
            tracker.track(frame, capture_ns=trial.capture_ns(number))
        else:
            _count(scores, tracker, trial, number)


def _count(scores: Scores, tracker: Tracker, trial: Trial, number: int) -> None:
    start = perf_counter()
    seen = tracker.track(trial.frames[number], capture_ns=trial.capture_ns(number))
    scores.milliseconds.append(1e3 * (perf_counter() - start))
    truth = trial.corners[number]
    if not seen.found or seen.tip_rad > 0:
        scores.miss(seen.reason)
    elif seen.identity == "marked":
        scores.add(seen.corners_px - truth, truth, seen.sigma_px)
    else:
        scores.add(aligned(seen.corners_px, truth), truth, seen.sigma_px)

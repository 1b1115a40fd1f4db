"""The tracker is compared with the limit of each kind of frame, beside ArUco and AprilTag on the same frames.

`pytest -m benchmark tests/benchmarks/test_tracking_limit.py -s`; TRACKING_FRAMES sets the frames a condition,
TRACKING_CONDITIONS (names between semicolons) takes only some, TRACKING_SEED other frames. A ratio is the corners' RMS
over the Cramér-Rao bound of the very frames in which a method found the mark (tests/benchmarks/tracking_rivals/bound.py
says what a bound takes as known). ArUco and AprilTag can read a mark with a code alone.
"""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from pi_agent.tracking.tracker import Tracker
from tests.benchmarks.tracking_rivals import apriltags
from tests.benchmarks.tracking_rivals.bound import bounds
from tests.benchmarks.tracking_rivals.conditions import ADVERSE, ADVERSE_TAPE, CODED, NORMAL, Maker, Trial
from tests.benchmarks.tracking_rivals.rivals import aruco
from tests.benchmarks.tracking_rivals.scores import WRONG_PX, aligned

pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(7200)]

TRIALS = int(os.environ.get("TRACKING_FRAMES", "60"))
SEED = int(os.environ.get("TRACKING_SEED", "20261217"))
WANTED = os.environ.get("TRACKING_CONDITIONS", "")
DICTIONARY, TAG_ID = "APRILTAG_16h5", 7
REFINEMENTS = ("SUBPIX", "CONTOUR", "APRILTAG")
ANOTHER_PX = 20.0  # a corner further off is that of another thing: not found
CONVENTION_PX = {"APRILTAG": 0.5}  # a refinement counts pixels from their corners, as AprilTag itself does
ENOUGH = 20  # frames from which a ratio is judged
DRAWS = 1000
LEVELS = ("known", "estimated", "outline", "shape")
HEAD = (
    f"{'frames':22s} {'method':17s} {'found':>7s} {'rms px':>7s} {'bound':>7s} {'ratio':>6s} {'95 % interval':>13s}"
    f" {'median':>6s}  ratio to " + ", ".join(LEVELS)
)

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Row:
    """A method on the frames of a condition: mean squared errors of the corners (n,), NaN where it found none.

    `limits`: the mean squared errors (n,) at each of the bounds.
    """

    condition: str
    method: str
    squares: Floats
    limits: dict[str, Floats]

    @property
    def found(self) -> NDArray[np.bool_]:
        """The frames in which the method found the mark and a bound exists."""
        return np.isfinite(self.squares) & np.isfinite(self.limits["estimated"])

    @property
    def right(self) -> int:
        """The frames in which it was found where it is."""
        return int(np.sum(self.squares[np.isfinite(self.squares)] < WRONG_PX**2))

    def ratio(self, level: str = "estimated") -> float:
        """RMS over the bound, of the frames in which it was found."""
        return float(np.sqrt(self.squares[self.found].sum() / self.limits[level][self.found].sum()))

    def interval(self) -> tuple[float, float]:
        """95 % interval of the ratio, by frames drawn anew."""
        squares, limits = self.squares[self.found], self.limits["estimated"][self.found]
        drawn = np.random.default_rng(0).integers(0, len(squares), (DRAWS, len(squares)))
        ratios = np.sqrt(squares[drawn].sum(axis=1) / limits[drawn].sum(axis=1))
        low, high = np.quantile(ratios, [0.025, 0.975]).tolist()
        return low, high

    def line(self) -> str:
        """One row of the table; see `HEAD`. `median`: of the frames' own ratios."""
        count = int(self.found.sum())
        start = f"{self.condition:22s} {self.method:17s} {count:3d}/{len(self.squares):3d}"
        if count < 2:
            return start
        squares, limits = self.squares[self.found], self.limits["estimated"][self.found]
        low, high = self.interval()
        return (
            f"{start} {np.sqrt(squares.mean()):7.4f} {np.sqrt(limits.mean()):7.4f} {self.ratio():6.2f}"
            f" {f'{low:.2f} to {high:.2f}':>13s} {np.median(np.sqrt(squares / limits)):6.2f}  "
            + "  ".join(f"{self.ratio(level):.2f}" for level in LEVELS)
        )


def _chosen() -> dict[str, Maker]:
    makers = {**CODED, **NORMAL, **ADVERSE, **ADVERSE_TAPE}
    return {name.strip(): makers[name.strip()] for name in WANTED.split(";")} if WANTED else makers


def _square(corners: Floats | None, truth: Floats) -> float:
    """Mean squared distance of the corners from the truth; NaN for none, or for another thing."""
    if corners is None or np.isnan(corners).any():
        return float("nan")
    error = min((aligned(order, truth) for order in (corners, corners[::-1])), key=lambda e: float(np.sum(e**2)))
    return float(np.mean(np.sum(error**2, axis=1))) if np.abs(error).max() < ANOTHER_PX else float("nan")


def _ours(trial: Trial, *, follow: bool) -> Floats | None:
    tracker, last = Tracker(trial.config), len(trial.frames) - 1
    for earlier in range(last if follow else 0):
        tracker.track(trial.frames[earlier], capture_ns=trial.capture_ns(earlier))
    seen = tracker.track(trial.frames[last], capture_ns=trial.capture_ns(last))
    return seen.corners_px if seen.found and seen.tip_rad == 0 else None


def _rivals(trials: list[Trial], folder: Path) -> dict[str, list[Floats | None]]:
    frames = [trial.frames[-1] for trial in trials]
    found: dict[str, list[Floats | None]] = {}
    for refinement in REFINEMENTS:
        method = aruco(refinement, dictionary=DICTIONARY, tag_id=TAG_ID)
        corners = [method(frame) for frame in frames]
        shift = CONVENTION_PX.get(refinement, 0.0)
        found[f"ArUco {refinement}"] = [None if each is None else each - shift for each in corners]
    if apriltags.installed():
        detected, _ = apriltags.detect_all(frames, folder, family="tag16h5", tag_id=TAG_ID)
        found["AprilTag"] = list(detected)
    else:
        print("AprilTag: skipped, pupil-apriltags is not installed (pip install pupil-apriltags)")
    return found


def _rows(name: str, folder: Path) -> list[Row]:
    trials = [_chosen()[name](np.random.default_rng([SEED, number])) for number in range(TRIALS)]
    each = [bounds(trial.scene, trial.pose).rms_px() for trial in trials]
    limits = {level: np.array([one[level] for one in each]) ** 2 for level in LEVELS}
    answers = {
        "ours, acquisition": [_ours(trial, follow=False) for trial in trials],
        "ours, followed": [_ours(trial, follow=True) for trial in trials],
        **(_rivals(trials, folder) if trials[0].config.mark.feature == "tag" else {}),
    }
    truths = [trial.corners[-1] for trial in trials]
    return [
        Row(name, method, np.array([_square(c, t) for c, t in zip(corners, truths, strict=True)]), limits)
        for method, corners in answers.items()
    ]


@pytest.mark.parametrize("name", _chosen())
def test_the_ratio_to_the_bound(name: str, tmp_path: Path) -> None:
    """Nobody is below the bound beyond chance, or it is none; and ours is nearer to it than the others are."""
    rows = _rows(name, tmp_path)
    print("\n" + HEAD)
    print("\n".join(row.line() for row in rows), flush=True)
    first, followed, *rivals = rows
    if first.found.sum() >= ENOUGH:
        assert first.interval()[1] >= 1.0
    for rival in rivals:
        assert rival.right <= followed.right
        assert rival.found.sum() < ENOUGH or followed.ratio() < rival.ratio()

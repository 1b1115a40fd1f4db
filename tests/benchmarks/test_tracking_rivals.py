"""Ours beside the other methods, on the same frames in one run: errors, missed frames, milliseconds.

`pytest -m benchmark tests/benchmarks/test_tracking_rivals.py -s`; TRACKING_FRAMES sets the frames a condition.
"""

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pi_agent.rendering import ExactRenderer, Glare, Layer, Scene, Sensor, plate_fiducials
from pi_agent.tracking.config import TrackerConfig
from pi_agent.tracking.mark import Feature, Mark
from pi_agent.tracking.tone import LINEAR, PI_DEFAULT, ToneCurve
from pi_agent.tracking.tracker import Tracker
from tests.benchmarks.tracking_rivals import apriltags
from tests.benchmarks.tracking_rivals.conditions import (
    PLATES,
    ROLLING,
    Trial,
    moving,
    nudged,
    random_mark,
    random_pose,
)
from tests.benchmarks.tracking_rivals.rivals import Method, aruco, corner_sub_pix, otsu_corners, paper
from tests.benchmarks.tracking_rivals.scores import HEAD, Scores, aligned

pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(3600)]

TRIALS = int(os.environ.get("TRACKING_FRAMES", "60"))
DICTIONARY, TAG_ID = "APRILTAG_16h5", 7
STILL_FRAMES = 300
REPEATS = 30
TIMED_MARKS: dict[str, tuple[float, Feature]] = {"tag": (0.16, "tag"), "dot": (0.16, "dot"), "bare tape": (0.0, "none")}

Shot = tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.float64], TrackerConfig]


@pytest.fixture(autouse=True)
def one_core() -> Iterator[None]:
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    yield
    cv2.setNumThreads(threads)


def _shots(kind: str) -> list[Shot]:
    """An earlier frame, the frame in question, its true corners, our settings."""
    shots: list[Shot] = []
    for number in range(TRIALS):
        rng = np.random.default_rng([99, number])
        tone: ToneCurve = PI_DEFAULT if "Pi curve" in kind else LINEAR
        margin = 0.0 if "bare" in kind else 0.16
        mark = random_mark(rng, margin=margin, feature="none" if "bare" in kind else "tag")
        scene = Scene(PLATES.pick(rng), mark=mark, sensor=Sensor(tone=tone), fiducials=plate_fiducials())
        pose = random_pose(rng)
        earlier, truth = ExactRenderer(scene).render(pose, rng=rng)
        x, y = (truth.mean(axis=0) + rng.normal(0, 50, 2)).tolist()
        if "glare" in kind:
            scene = replace(scene, glare=(Glare(x, y, float(rng.uniform(5, 30)), float(rng.uniform(0.3, 1.5))),))
        if "clutter" in kind:
            bar = np.array([[0.0, -1.0], [1.0, -1.0], [1.0, 1.0], [0.0, 1.0]]) * np.array([25.0, 290.0])
            place = truth.max(axis=0)[0] + 2.5 * mark.margin * mark.side_mm * 6.0 + 4.0
            scene = replace(scene, clutter=(Layer((bar + np.array([place, 300.0]),), 0.05),))
        frame, truth = ExactRenderer(scene).render(nudged(pose, rng), rng=rng)
        shots.append((earlier, frame, truth, TrackerConfig(mark=mark, tone=tone)))
    return shots


def _rival(method: Method, shots: list[Shot]) -> Scores:
    scores = Scores()
    for _, frame, truth, _ in shots:
        start = perf_counter()
        corners = method(frame)
        scores.milliseconds.append(1e3 * (perf_counter() - start))
        _count(scores, corners, truth)
    return scores


def _count(scores: Scores, corners: NDArray[np.float64] | None, truth: NDArray[np.float64], sigma: float = 1.0) -> None:
    error = (
        None
        if corners is None
        else min((aligned(order, truth) for order in (corners, corners[::-1])), key=lambda e: float(np.sum(e**2)))
    )
    if error is None or float(np.abs(error).max()) > 20.0:
        scores.miss("none, or another thing")
    else:
        scores.add(error, truth, sigma)


def _ours(shots: list[Shot], *, follow: bool) -> Scores:
    scores = Scores()
    for earlier, frame, truth, config in shots:
        tracker = Tracker(config)
        if follow:
            tracker.track(earlier, capture_ns=0)
        start = perf_counter()
        seen = tracker.track(frame, capture_ns=11_111_111)
        scores.milliseconds.append(1e3 * (perf_counter() - start))
        _count(scores, seen.corners_px if seen.found else None, truth, seen.sigma_px)
    return scores


def _pupil(shots: list[Shot], folder: Path) -> Scores | None:
    if not apriltags.installed():
        print("pupil-apriltags: skipped, not installed (pip install pupil-apriltags)")
        return None
    frames = [frame for _, frame, _, _ in shots]
    corners, milliseconds = apriltags.detect_all(frames, folder, family="tag16h5", tag_id=TAG_ID)
    scores = Scores(milliseconds=milliseconds.tolist())
    for found, (_, _, truth, _) in zip(corners, shots, strict=True):
        _count(scores, None if np.isnan(found).any() else found, truth)
    return scores


def _where_not_ahead(ours: Scores, rivals: dict[str, Scores]) -> str:
    """Names the others that are more exact than ours, and those that are faster, with how much less exact they are."""
    exact = [name for name, scores in rivals.items() if scores.errors and scores.rms_px <= ours.rms_px]
    faster = [
        f"{name} ({scores.rms_px / ours.rms_px:.0f} times the error)" if scores.errors else f"{name} (finds nothing)"
        for name, scores in rivals.items()
        if min(scores.milliseconds) < min(ours.milliseconds)
    ]
    return f"More exact than ours: {', '.join(exact) or 'none'}. Faster: {', '.join(faster) or 'none'}."


@pytest.mark.parametrize(
    "kind", ["tag, linear", "tag, Pi curve", "tag, glare", "tag, clutter", "bare tape, linear", "bare tape, Pi curve"]
)
def test_ours_is_ahead(kind: str, tmp_path: Path) -> None:
    shots = _shots(kind)
    ours = {"ours, acquisition": _ours(shots, follow=False), "ours, followed": _ours(shots, follow=True)}
    rivals = {
        "the paper's": _rival(paper, shots),
        "Otsu + polygon": _rival(otsu_corners, shots),
        "cornerSubPix": _rival(corner_sub_pix, shots),
    }
    if "tag" in kind:
        for refinement in ("NONE", "SUBPIX", "CONTOUR", "APRILTAG"):
            method = aruco(refinement, dictionary=DICTIONARY, tag_id=TAG_ID)
            rivals[f"aruco {refinement}"] = _rival(method, shots)
        pupil = _pupil(shots, tmp_path)
        if pupil is not None:
            rivals["pupil-apriltags"] = pupil
    print(f"\n{kind}\n{HEAD}")
    for name, scores in {**ours, **rivals}.items():
        print(scores.line(name))
    followed = ours["ours, followed"]
    print(_where_not_ahead(followed, rivals))
    for scores in rivals.values():
        assert not scores.errors or followed.rms_px < scores.rms_px
        assert len(followed.errors) - followed.wrong >= len(scores.errors) - scores.wrong


def _times_ms(trial: Trial, *, settled: int) -> NDArray[np.float64]:
    """The least time that each frame of a sequence after the first `settled` ones took."""
    rounds = []
    for _ in range(REPEATS):
        tracker, times, seen = Tracker(trial.config), [], None
        for number, frame in enumerate(trial.frames):
            start = perf_counter()
            seen = tracker.track(frame, capture_ns=trial.capture_ns(number))
            times.append(1e3 * (perf_counter() - start))
        assert seen is not None
        assert seen.found, seen.reason
        rounds.append(times[settled:])
    return np.min(rounds, axis=0)


def test_the_time_of_a_frame() -> None:
    """Prints milliseconds a frame in steady state and at acquisition; no assertion: clocks are not for tests.

    The least of many repeats of each frame: its own time, without what else the machine did. The frames of a sequence
    differ in how many passes they need.
    """
    print(
        f"\n{'a frame of':28s} {'best':>6s} {'median':>6s} {'worst':>6s}  ms, each frame's least of {REPEATS} repeats"
    )
    for speed_mm_s in (0.0, 30.0, 300.0):
        for name, (margin, feature) in TIMED_MARKS.items():
            rng = np.random.default_rng(11)
            mark = Mark(side_mm=15.0, margin=margin, feature=feature, tag_id=TAG_ID)
            scene = Scene(PLATES.pick(rng, "wood"), mark=mark, shutter=ROLLING, fiducials=plate_fiducials())
            turn_rad_s = 1.5 if speed_mm_s else 0.0
            trial = moving(scene, rng, speed_mm_s=speed_mm_s, turn_rad_s=turn_rad_s, frames=14)
            times = _times_ms(trial, settled=4)
            state = f"{name}, {speed_mm_s / 1000:.2f} m/s"
            print(f"{state:28s} {times.min():6.3f} {np.median(times):6.3f} {times.max():6.3f}", flush=True)
    shot = _shots("tag, linear")[0]
    tracker, acquired, still = Tracker(shot[3]), [], []
    for number in range(40):
        tracker.reset()
        start = perf_counter()
        tracker.track(shot[0], capture_ns=number * 11_111_111)
        acquired.append(1e3 * (perf_counter() - start))
    for number in range(STILL_FRAMES):
        start = perf_counter()
        tracker.track(shot[0], capture_ns=number * 11_111_111)
        still.append(1e3 * (perf_counter() - start))
    print(f"at rest: min {min(still):.3f}, median {np.median(still):.3f} ms; acquisition: min {min(acquired):.2f} ms")
    print(f"Pi 3B at 8 to 12 times this core: {8 * min(still):.1f} to {12 * min(still):.1f} ms of the 11.1 ms at 90 Hz")
    assert tracker.track(shot[0], capture_ns=0).found

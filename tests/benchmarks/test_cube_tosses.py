"""Real tosses of a cube are diagnosed, and label-permuted copies of them, its nulls.

    REPOSE_CUBE_TOSSES=tosses.parquet pytest -m benchmark -s tests/benchmarks/test_cube_tosses.py

prints how often anything is claimed of a copy; TOSSES_COPIES says how many there are (20), TOSSES_JOBS how many at a
time. `tosses` says how a copy is made.
"""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from station.app.diagnosing import diagnose_file
from station.diagnosis.result import Diagnosis
from station.pool import spread
from station.recording.importers import cube_tosses, write
from tests.benchmarks.tosses import Toss, heading_of, permuted, slide_of, tosses_of, turned, write_table
from tests.proof.intervals import wilson

REAL = Path(os.environ.get("REPOSE_CUBE_TOSSES", ""))
COPIES, JOBS = int(os.environ.get("TOSSES_COPIES", "20")), int(os.environ.get("TOSSES_JOBS", "2"))
CHANCE = 0.1
"""A diagnosis is calibrated to claim something of one null in twenty; more than this it claims by a fault."""

needs_data = pytest.mark.skipif(not REAL.is_file(), reason="REPOSE_CUBE_TOSSES does not name the table of tosses")


def diagnosed(folder: Path, named: tuple[str, list[Toss]]) -> Diagnosis:
    """Returns the diagnosis that the command makes of the named tosses."""
    name, tosses = named
    path = folder / f"{name}.mcap"
    write(cube_tosses.read(write_table(tosses, folder / f"{name}.parquet")), path)
    try:
        return diagnose_file(path).diagnosis
    finally:
        path.unlink()


def said(name: str, found: Diagnosis) -> str:
    gain = f"{found.fit.log_score_gain:+.2f} ± {found.fit.gain_se:.2f}"
    claims = ", ".join(f"{one.id} ({one.probability:.2f})" for one in found.effects) or "nothing"
    return f"{name:10s} {found.verdict:18s} p = {found.global_p:<8.2g} gain a run {gain:16s} {claims}"


@needs_data
@pytest.mark.benchmark
@pytest.mark.timeout(3600)
def test_how_often_anything_is_claimed_of_permuted_tosses(tmp_path: Path) -> None:
    tosses = tosses_of(REAL)
    print(f"\n{len(tosses)} tosses, {sum(toss.slide.stop > 0 for toss in tosses)} of which slide flat")
    print(said("recorded", diagnosed(tmp_path, ("recorded", tosses))))
    copies = [permuted(tosses, np.random.default_rng([20261127, number])) for number in range(COPIES)]
    named = [(f"copy {number}", copy) for number, copy in enumerate(copies, start=1)]
    claimed = 0
    with spread(partial(diagnosed, tmp_path), named, jobs=JOBS) as made:
        for (name, _), found in zip(named, made, strict=True):
            claimed += found.verdict in {"supported", "indistinguishable"}
            print(said(name, found), flush=True)
    low, high = wilson(claimed, COPIES)
    print(f"claimed of copies: {claimed} of {COPIES}, {claimed / COPIES:.0%} ({low:.0%} … {high:.0%} at 95 %)")
    assert low < CHANCE


def made_up(rng: np.random.Generator, *, frames: int = 90, stop: int = 60, swerve_m: float = 0.0) -> Toss:
    """A slide that slows down evenly in 60 frames, with noise, from a heading and a speed of its own.

    It swerves to the left by `swerve_m`, and turns to the left by half a radian a second.
    """
    seconds, speed = np.minimum(np.arange(frames), stop) / 148.0, rng.uniform(0.45, 0.6)
    way = speed * seconds - 0.5 * (speed * 148.0 / stop) * seconds**2
    aside = swerve_m * (seconds * 148.0 / stop) ** 2
    direction = rng.uniform(0.0, 6.0)
    x = way + rng.normal(0, 1e-4, frames) * (np.arange(frames) < stop)
    place = np.column_stack([x, aside]) @ np.array(
        [[np.cos(direction), np.sin(direction)], [-np.sin(direction), np.cos(direction)]]
    )
    identity = np.tile([1.0, 0.0, 0.0, 0.0], (frames, 1))
    heading = rng.uniform(0, 6.0) + 0.5 * seconds
    pose = np.column_stack([place, np.full(frames, 0.0524), turned(identity, heading)])
    return Toss(np.arange(frames, dtype=float), pose, slide_of(pose))


def test_a_copy_keeps_levels_speeds_and_noise_and_deals_them_out_anew() -> None:
    rng = np.random.default_rng(1)
    tosses = [made_up(rng) for _ in range(60)]
    copy = permuted(tosses, rng)
    before, after = (np.array([_told(toss) for toss in each]) for each in (tosses, copy))
    for column, most in ((0, 0.02), (1, 0.02), (2, 0.15)):
        assert np.sort(before[:, column]) == pytest.approx(np.sort(after[:, column]), rel=most)
    assert np.corrcoef(before[:, 0], before[:, 1])[0, 1] > 0.9, "made so: the faster, the more friction"
    assert abs(np.corrcoef(after[:, 0], after[:, 1])[0, 1]) < 0.4
    starts = [np.sort([toss.pose[toss.slide.start, 0] for toss in each]) for each in (tosses, copy)]
    assert starts[0] == pytest.approx(starts[1], abs=5e-4)
    ways = [np.arctan2(*(toss.pose[toss.slide.stop - 1, :2] - toss.pose[toss.slide.start, :2])) for toss in copy]
    assert np.std(ways) > 1.0
    headings = [heading_of(toss.pose[toss.slide, 3:])[0] - way for toss, way in zip(copy, ways, strict=True)]
    assert np.std(headings) > 1.0
    steps = [np.diff(toss.pose[toss.slide.start :, :2], axis=0) for toss in copy]
    assert max(float(np.linalg.norm(step, axis=1).max()) for step in steps) < 7e-3, "no jump where the slide ends"


def _told(toss: Toss) -> tuple[float, float, float]:
    """Deceleration, speed at first, and root mean square beside the parabola."""
    seconds = (toss.frame[toss.slide] - toss.frame[toss.slide][0]) / 148.0
    basis = np.column_stack([np.ones_like(seconds), seconds, seconds**2])
    way = toss.pose[toss.slide, :2]
    fit = np.linalg.lstsq(basis, way, rcond=None)[0]
    left = way - basis @ fit
    return 2.0 * float(np.linalg.norm(fit[2])), float(np.linalg.norm(fit[1])), float(np.sqrt(np.mean(left**2)))


def test_a_copy_knows_no_left_and_right() -> None:
    """Slides that all swerve to one side and turn to one side are no sample of constant friction."""
    rng = np.random.default_rng(2)
    tosses = [made_up(rng, swerve_m=1e-3) for _ in range(80)]
    copy = permuted(tosses, rng)
    before, after = (np.array([_sides(toss) for toss in each]) for each in (tosses, copy))
    assert before.min(axis=0) == pytest.approx([2.5e-4, 0.5], rel=0.3)
    assert np.abs(after).mean(axis=0) == pytest.approx(np.abs(before).mean(axis=0), rel=0.5)
    for column in after.T:
        assert abs(column.mean()) < 4.0 * column.std() / np.sqrt(len(column))
    assert abs(np.corrcoef(after.T)[0, 1]) < 0.4, "which way it turns says nothing of where it swerves"


def _sides(toss: Toss) -> tuple[float, float]:
    """Returns how far a slide's middle lies right of its chord, m, and how fast the block turns to the left, rad/s."""
    part = toss.pose[toss.slide]
    chord = part[-1, :2] - part[0, :2]
    way = part[:, :2] - part[0, :2]
    along, aside = way @ chord / np.hypot(*chord), way @ np.array([chord[1], -chord[0]]) / np.hypot(*chord)
    middle = float(np.interp(0.75 * along[-1], along, aside))
    return middle, float(np.polyfit(np.arange(len(part)) / 148.0, heading_of(part[:, 3:]), 1)[0])

"""A block is held as long as it is seen to lie where it was: an unnoticed slide to the foam ends it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from station.diagnosis.observations.tracks import RunTrack
from tests.unit.view.session import sample

HZ, TILT_S, END_S = 90.0, 1.0, 12.0


def track(moved_m: float, *, at_s: float = 5.0, over_s: float = 0.2, noise_m: float = 1e-5) -> RunTrack:
    """A run without an onset, in which the block goes `moved_m` along x within `over_s`."""
    time_s = np.arange(0.0, END_S, 1.0 / HZ)
    pose = np.random.default_rng(5).normal(0.0, noise_m, (len(time_s), 3))
    pose[:, 0] += moved_m * np.clip((time_s - at_s) / over_s, 0.0, 1.0)
    ends = [round(second * 1e9) for second in (TILT_S, END_S)]
    return RunTrack(
        sample=replace(sample(), censored=True),
        time_ns=np.round(time_s * 1e9).astype(np.int64),
        pose=pose,
        corner_m=None,
        level_ns=0,
        tilt_ns=ends[0],
        slip_ns=0,
        stop_ns=0,
        end_ns=ends[1],
        sigma_m=noise_m,
        sigma_rad=1e-3,
        corner_sigma_m=noise_m,
    )


def test_a_block_that_slides_to_the_foam_is_held_no_longer() -> None:
    """It slides by 4 mm in a fifth of a second."""
    assert track(4e-3).held_until_ns == pytest.approx(5e9, abs=1e8)


@pytest.mark.parametrize(("moved_m", "over_s", "noise_m"), [(0.0, 0.2, 1e-5), (1e-3, 5.0, 1e-5), (0.0, 0.2, 3e-4)])
def test_a_block_that_lies_or_creeps_or_is_seen_badly_is_held_to_the_end(
    moved_m: float, over_s: float, noise_m: float
) -> None:
    run = track(moved_m, over_s=over_s, noise_m=noise_m)
    assert run.held_until_ns == run.end_ns


def test_a_wrong_corner_is_no_motion() -> None:
    """Three frames in a row whose mark seems to lie 3 mm away."""
    run = track(0.0)
    run.pose[500:503, 0] += 3e-3
    assert run.held_until_ns == run.end_ns

"""Blocks that somebody moves while they should rest: their samples do not count."""

from __future__ import annotations

import math

import pytest

from tests.recovery.pushed_blocks import Disturbance, samples_of

SURE = 4.0
TAPPED = Disturbance(at_rad=math.radians(8.0), speed_m_s=0.045, for_s=0.004, times=20)
"""Twenty hops of some 0.4 mm, five a second."""
PUSHED = Disturbance(at_rad=math.radians(8.0), speed_m_s=0.05, for_s=0.16)
"""A push of 8 mm."""


@pytest.mark.parametrize("what", [TAPPED, PUSHED], ids=["tapped", "pushed"])
def test_no_sample_that_counts_is_false(what: Disturbance) -> None:
    """They had onsets of 7.4 to 10.8 degrees, ± 0.01 to 0.2, where friction held to 11 to 25."""
    told = samples_of(what, samples=4, seed=20261935, limit_s=40.0)
    assert len(told) >= 4
    wrong = [
        [math.degrees(angle) for angle in (one.onset_angle_rad, one.onset_sigma_rad, true)]
        for one, true in told
        if not one.disturbed and abs(one.onset_angle_rad - true) > SURE * one.onset_sigma_rad + math.radians(0.1)
    ]
    assert not wrong


def test_no_sample_is_lost_in_a_session_that_nobody_disturbs() -> None:
    told = samples_of(None, samples=12, seed=20261936, limit_s=200.0)
    assert [one.flags for one, _ in told] == [()] * 12
    assert max(one.onset_sigma_rad for one, _ in told) < math.radians(0.3)

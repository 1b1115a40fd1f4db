"""Frames and attitudes that are missing where a block begins to slide."""

from __future__ import annotations

import math

import pytest

from station.sampling.unseen import are_away, may_have_met_foam

PULL_M_S2 = 0.4
"""The acceleration of a block that slides, m/s²; without friction it would be 3.4 m/s² at this tilt."""
TILT_RAD = math.radians(20.0)
MS = 1_000_000


def path(*, every_ms: int, until_ms: int, without_ms: range = range(0)) -> list[tuple[int, float]]:
    """Returns frames from a second before the onset, which is at 0, without those of some milliseconds."""
    times = [ms for ms in range(-1000, until_ms + 1, every_ms) if ms not in without_ms]
    return [(ms * MS, 0.5 * PULL_M_S2 * (max(ms, 0) * 1e-3) ** 2) for ms in times]


@pytest.mark.parametrize("every_ms", [5, 11, 20, 33, 50])
def test_frames_at_the_rate_of_any_camera_show_a_block_that_has_its_way_before_it(every_ms: int) -> None:
    assert not may_have_met_foam(path(every_ms=every_ms, until_ms=140), from_ns=0, way_m=0.018, tilt_rad=TILT_RAD)


@pytest.mark.parametrize(("gone_ms", "unseen"), [(40, False), (150, True), (900, True)])
def test_in_a_long_gap_the_block_may_have_come_to_the_foam(gone_ms: int, unseen: bool) -> None:
    seen = path(every_ms=11, until_ms=gone_ms + 50, without_ms=range(1, gone_ms))
    assert may_have_met_foam(seen, from_ns=0, way_m=0.018, tilt_rad=TILT_RAD) == unseen


def test_a_gap_before_the_onset_hides_nothing() -> None:
    seen = path(every_ms=11, until_ms=140, without_ms=range(-900, -100))
    assert not may_have_met_foam(seen, from_ns=0, way_m=0.018, tilt_rad=TILT_RAD)


def test_without_foam_nothing_stops_the_block() -> None:
    seen = path(every_ms=11, until_ms=950, without_ms=range(1, 900))
    assert not may_have_met_foam(seen, from_ns=0, way_m=math.inf, tilt_rad=TILT_RAD)


def test_a_block_that_is_about_to_reach_the_foam_may_have_reached_it() -> None:
    seen = path(every_ms=33, until_ms=140)
    assert may_have_met_foam(seen, from_ns=0, way_m=0.004, tilt_rad=TILT_RAD)


@pytest.mark.parametrize(
    ("from_ms", "to_ms", "away"),
    [(-100, 0, False), (-250, 250, False), (-50, 250, True), (10, 60, True), (110, 300, True)],
)
def test_readings_are_away_where_an_interval_is_longer_than_half_of_the_slide_that_it_touches(
    from_ms: int, to_ms: int, away: bool
) -> None:
    readings_ns = [ms * MS for ms in (*range(-500, 1, 10), *range(200, 500, 10))]
    assert are_away(readings_ns, from_ns=from_ms * MS, to_ns=to_ms * MS) == away

"""A clock that was set is told from one that drifts, and from one whose round trips are long."""

from __future__ import annotations

import pytest

from station.sampling.clock_step import is_another_clock

MS = 1_000_000


@pytest.mark.parametrize(
    ("by_ms", "round_trips_ms", "another"),
    [(0.5, 0.1, False), (400.0, 0.1, True), (-400.0, 0.1, True), (3.0, 0.1, True), (3.0, 40.0, False)],
)
def test_an_offset_that_changes_by_more_than_it_may_be_off(by_ms: float, round_trips_ms: float, another: bool) -> None:
    before_ns = 17 * MS
    after_ns = before_ns + round(by_ms * MS)
    assert is_another_clock(before_ns, after_ns, round_trips_ns=round(round_trips_ms * MS)) == another

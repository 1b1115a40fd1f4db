"""Encoders that are stuck are told from a plate at rest, from one that turns late, and from coarse encoders."""

from __future__ import annotations

import math

import pytest

from station.sampling.stuck import Repeats

MS = 1_000_000
SLIDE_NS = 350 * MS


def told(tilts_deg: list[float], *, moves: range, rate_deg_s: float, slide_ns: int = SLIDE_NS) -> bool:
    """Returns true if readings every 10 ms are found stuck; the plate is said to turn in `moves` of them."""
    repeats = Repeats()
    for number, tilt_deg in enumerate(tilts_deg):
        if number in (moves.start, moves.stop):
            repeats.take_motion(under_way=number == moves.start)
        half = 0.5 * math.radians(tilt_deg)
        quaternion = (math.cos(half), math.sin(half), 0.0, 0.0)
        repeats.take(quaternion, tilt_rad=math.radians(tilt_deg), stamp_ns=number * 10 * MS)
    return repeats.are_stuck(since_ns=0, slide_ns=slide_ns, rate_rad_s=math.radians(rate_deg_s))


def turning(count: int, *, rate_deg_s: float = 5.0) -> list[float]:
    return [10.0 + 0.01 * rate_deg_s * number for number in range(count)]


def test_a_plate_that_turns_has_another_attitude_each_time() -> None:
    assert not told(turning(100), moves=range(0, 100), rate_deg_s=5.0)


def test_a_plate_at_rest_has_one_attitude() -> None:
    assert not told([*turning(40), *[11.95] * 300], moves=range(0, 41), rate_deg_s=5.0)


def test_a_plate_that_begins_to_turn_late_is_read_honestly() -> None:
    assert not told([10.0] * 60 + turning(60), moves=range(20, 120), rate_deg_s=5.0)


@pytest.mark.parametrize(("rate_deg_s", "quantum_deg"), [(5.0, 0.1), (1.0, 0.1), (0.2, 0.01)])
def test_coarse_encoders_are_not_stuck(rate_deg_s: float, quantum_deg: float) -> None:
    read = [quantum_deg * round(tilt / quantum_deg) for tilt in turning(300, rate_deg_s=rate_deg_s)]
    assert not told(read, moves=range(0, 300), rate_deg_s=rate_deg_s)


@pytest.mark.parametrize("hold", [0, 40, 300])
def test_a_reading_that_jumps_was_stuck(hold: int) -> None:
    true = [10.0] * hold + turning(100)
    stuck = [*true[: hold + 30], *[true[hold + 30]] * 30, *true[hold + 60 :]]
    assert told(stuck, moves=range(hold, hold + 100), rate_deg_s=5.0)


def test_a_reading_that_has_not_changed_by_the_end_of_a_motion_was_stuck() -> None:
    assert told([10.0] * 100, moves=range(20, 60), rate_deg_s=5.0)


def test_a_slide_of_several_times_that_length_is_well_read() -> None:
    stuck = [*turning(30), *[11.45] * 8, *turning(100)[38:]]
    assert not told(stuck, moves=range(0, 100), rate_deg_s=5.0)

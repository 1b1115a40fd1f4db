"""Readings of the tilt that repeat: a plate at rest, encoders that are stuck, and coarse ones."""

from __future__ import annotations

import math

import numpy as np
import pytest

from station.friction.onset_loads import Array
from station.friction.onset_repeats import without_repeats

EVERY_S = 0.01
RATE_RAD_S = math.radians(5.0)
TIME_S: Array = EVERY_S * np.arange(100, dtype=np.float64)
TURNING: Array = RATE_RAD_S * TIME_S


@pytest.mark.parametrize("count", [2, 3, 10, 40])
@pytest.mark.parametrize("first", [5, 50])
def test_a_reading_that_is_stuck_while_the_plate_turns_is_read_off_its_neighbours(count: int, first: int) -> None:
    stuck = TURNING.copy()
    stuck[first : first + count] = stuck[first]
    tilt, found = without_repeats(TIME_S, stuck)
    assert tilt == pytest.approx(TURNING, abs=1e-12)
    assert (found.begin_s.item(), found.end_s.item()) == (TIME_S[first], TIME_S[first + count])
    assert found.turn_rad.item() == pytest.approx(RATE_RAD_S * count * EVERY_S)


@pytest.mark.parametrize("later", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("speeds_up", [False, True])
def test_a_plate_that_lies_still_and_begins_to_turn_is_believed(later: float, *, speeds_up: bool) -> None:
    """It begins at any moment between two readings, at its full speed or with less."""
    turned_s = np.maximum(TIME_S - TIME_S[49] - (1.0 - later) * EVERY_S, 0.0)
    resting = 0.2 + RATE_RAD_S * (turned_s**2 if speeds_up else turned_s)
    tilt, found = without_repeats(TIME_S, resting)
    assert tilt is resting
    assert len(found.begin_s) == 0


def test_a_coarse_encoders_readings_are_those_at_which_it_changes() -> None:
    step = 4.5 * RATE_RAD_S * EVERY_S
    coarse = step * np.floor(TURNING / step)
    tilt, found = without_repeats(TIME_S, coarse)
    assert len(found.begin_s) == 22
    assert np.abs(tilt - TURNING)[:-5].max() < 0.25 * step
    assert np.abs(coarse - TURNING).max() > 0.75 * step


def test_readings_that_repeat_to_the_end_stay_but_are_not_trusted() -> None:
    """Nobody knows if the plate has stopped; one that was slowing down has."""
    stopped = np.minimum(TURNING, TURNING[90])
    tilt, found = without_repeats(TIME_S, stopped)
    assert tilt is stopped
    assert found.turn_rad.item() == pytest.approx(RATE_RAD_S * 9 * EVERY_S)
    slowing = TURNING[90] - RATE_RAD_S * np.maximum(TIME_S[90] - TIME_S, 0.0) ** 2
    assert without_repeats(TIME_S, slowing)[1].turn_rad.item() < 0.02 * RATE_RAD_S * EVERY_S * 9


def test_a_plate_that_never_turns_has_nothing_to_doubt() -> None:
    still = np.full(100, 0.2)
    tilt, found = without_repeats(TIME_S, still)
    assert tilt is still
    assert not found.turn_rad.any()
    assert not found.ways_m(TIME_S).any()


def test_a_steeper_plate_makes_a_block_faster_from_then_on() -> None:
    stuck = TURNING.copy()
    stuck[50:60] = stuck[50]
    _, found = without_repeats(TIME_S, stuck)
    ways = found.ways_m(TIME_S)
    assert not ways[:51].any()
    gained = 9.81 * RATE_RAD_S * 0.1 / math.sqrt(12.0) * 0.05
    assert np.diff(ways[60:], axis=0) / EVERY_S == pytest.approx(gained)

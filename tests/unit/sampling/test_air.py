"""A reading of the air holds for a minute, by its own stamp and by the station's clock."""

from __future__ import annotations

import pytest

from shared.messages import Environment
from station.sampling.air import Air

SECOND = 1_000_000_000
NOW_NS = 1_000 * SECOND


def test_nobody_measures_the_air_of_most_rigs():
    assert Air().at(NOW_NS) is None


@pytest.mark.parametrize(("late_s", "held"), [(-5, True), (0, True), (59, True), (61, False), (86_400, False)])
def test_a_reading_holds_for_a_minute(late_s: int, held: bool):
    air, reading = Air(), Environment(NOW_NS, temperature_c=21.5)
    assert air.take(reading, now_ns=NOW_NS)
    assert air.at(NOW_NS + late_s * SECOND) == (reading if held else None)


@pytest.mark.parametrize("late_s", [86_400, -86_400])
def test_a_reading_of_another_time_is_not_taken(late_s: int):
    air, reading = Air(), Environment(NOW_NS, temperature_c=21.5)
    air.take(reading, now_ns=NOW_NS)
    assert not air.take(Environment(NOW_NS - late_s * SECOND, temperature_c=30.0), now_ns=NOW_NS)
    assert air.at(NOW_NS) == reading

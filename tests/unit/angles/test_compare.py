"""The numbers: against sums done by hand, against scipy, and the coverage of the intervals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from shared.errors import UserError
from shared.messages import AngleReading, Message, RunEvent, TiltCommand
from station.angles.compare import COMMANDED, Comparison, Pair, compare, regress
from station.angles.stops import Series, Stop, stops_of

Array = NDArray[np.float64]
UP_AND_DOWN = [*range(11), *range(9, 0, -1)]


def stop(angle_deg: float, series: dict[str, list[float]], *, approach: int = 1, index: int = 0) -> Stop:
    """A stop of one second; each source's readings (degrees) are spread evenly over it."""
    begin = index * 10**10
    return Stop(
        sweep=1,
        step=index + 1,
        angle_rad=math.radians(angle_deg),
        approach=approach,
        begin_ns=begin,
        end_ns=begin + 10**9,
        series={
            name: Series(
                stamp_ns=begin + ((np.arange(len(values)) + 0.5) / max(len(values), 1) * 1e9).astype(np.int64),
                angle_rad=np.radians(np.array(values, dtype=np.float64)),
            )
            for name, values in series.items()
        },
    )


def pair_of(comparison: Comparison, first: str, second: str) -> Pair:
    return next(pair for pair in comparison.pairs if {pair.first, pair.second} == {first, second})


def test_table_one_by_hand() -> None:
    found = compare([stop(5.0, {"a": [5.1, 5.3], "b": [4.9, 5.0]})], readings=2)
    against = pair_of(found, "commanded", "a")
    assert math.degrees(against.mean_abs_rad) == pytest.approx(0.2)
    assert math.degrees(against.bias_rad) == pytest.approx(-0.2)
    assert math.degrees(against.sd_rad) == pytest.approx(0.2 / math.sqrt(2))
    between = pair_of(found, "a", "b")
    assert math.degrees(between.mean_abs_rad) == pytest.approx(0.25)
    assert math.degrees(between.sd_rad) == pytest.approx(0.1 / math.sqrt(2))
    assert between.count == 2


def test_the_spread_is_that_of_the_signed_difference_as_in_the_paper() -> None:
    # Errors of +1 and -1: |d| is always 1 and has no spread; the paper's table has spreads above its means.
    found = compare([stop(0.0, {"a": [1.0, -1.0] * 25})], readings=50)
    pair = pair_of(found, COMMANDED, "a")
    assert math.degrees(pair.mean_abs_rad) == pytest.approx(1.0)
    assert math.degrees(pair.sd_rad) == pytest.approx(1.0, rel=0.02)


def test_sources_of_different_rates_are_held_against_each_other_at_the_same_instants() -> None:
    fast = [float(index) for index in range(100)]
    found = compare([stop(0.0, {"fast": fast, "slow": [24.5, 74.5]})], readings=50)
    pair = pair_of(found, "fast", "slow")
    assert pair.count == 50
    assert math.degrees(pair.mean_abs_rad) == pytest.approx(12.5, abs=0.6)


def test_a_value_typed_in_once_counts_for_the_whole_stop() -> None:
    found = compare([stop(2.0, {"gauge": [2.1], "imu": [2.0] * 50})], readings=50)
    pair = pair_of(found, "gauge", "imu")
    assert pair.count == 50
    assert math.degrees(pair.mean_abs_rad) == pytest.approx(0.1)
    assert math.degrees(pair.sd_rad) == pytest.approx(0.0, abs=1e-9)


def test_stops_at_which_a_source_was_silent_are_left_out_of_its_pairs_only() -> None:
    stops = [
        stop(0.0, {"a": [0.1] * 5, "b": [0.2] * 5}, index=0),
        stop(1.0, {"a": [1.1] * 5, "b": []}, index=1),
    ]
    found = compare(stops, readings=5)
    assert pair_of(found, "a", "b").count == 5
    assert pair_of(found, COMMANDED, "a").count == 10
    assert {fit.source: fit.stops for fit in found.fits} == {"a": 2, "b": 1}


def test_another_reference_can_be_asked_for_and_an_unknown_one_is_refused() -> None:
    stops = [stop(0.0, {"a": [0.1] * 5, "b": [0.2] * 5})]
    found = compare(stops, reference="b")
    assert found.sources == ("b", "commanded", "a")
    assert [fit.source for fit in found.fits] == ["a"]
    with pytest.raises(UserError, match="commanded, a, b"):
        compare(stops, reference="c")


def test_no_readings_at_all_are_told() -> None:
    with pytest.raises(UserError, match="there are none"):
        compare([stop(0.0, {"a": []})])


def planted(
    rng: np.random.Generator, *, offset_deg: float, gain: float, hysteresis_deg: float, sd_deg: Array
) -> tuple[Array, Array, Array]:
    """Differences (n,), angles (n,) and approaches (n,) of five sweeps, in degrees."""
    angle = np.array(UP_AND_DOWN * 5, dtype=float)
    approach = np.array(([-1.0] + [1.0] * 10 + [-1.0] * 9) * 5)
    noise = np.tile(sd_deg, 5) * rng.standard_normal(len(angle))
    return offset_deg + (gain - 1) * angle + hysteresis_deg * approach / 2 + noise, angle, approach


def test_the_fit_is_least_squares() -> None:
    rng = np.random.default_rng(1)
    difference, angle, approach = planted(rng, offset_deg=0.5, gain=1.02, hysteresis_deg=0.3, sd_deg=np.full(20, 0.1))
    found, scatter = regress(difference, angle_rad=angle, approach=approach)
    design = np.column_stack([np.ones_like(angle), angle, approach / 2])
    expected, residual, *_ = np.linalg.lstsq(design, difference, rcond=None)
    values = [estimate.value for estimate in found.values() if estimate is not None]
    assert values == pytest.approx(expected)
    assert scatter == pytest.approx(math.sqrt(residual[0] / 97))


def test_with_equal_noise_the_intervals_are_the_textbooks() -> None:
    rng = np.random.default_rng(2)
    angle = np.tile(np.arange(11.0), 200)
    difference = 0.1 * angle + 0.2 * rng.standard_normal(len(angle))
    found, _ = regress(difference, angle_rad=angle, approach=np.ones_like(angle))
    plain: Any = stats.linregress(angle, difference)
    gain = found["gain"]
    assert gain is not None
    assert gain.value == pytest.approx(plain.slope)
    assert (gain.high - gain.low) / 2 == pytest.approx(1.96 * plain.stderr, rel=0.05)


@pytest.mark.parametrize("uneven", [False, True])
def test_intervals_cover_what_was_planted(uneven: bool) -> None:
    """95 % intervals hold the truth in 95 % of comparisons, also when the noise grows with the tilt."""
    rng = np.random.default_rng(3)
    sd = 0.02 + 0.05 * np.array(UP_AND_DOWN, dtype=float) if uneven else np.full(20, 0.1)
    truth = {"offset": 0.5, "gain": 0.01, "hysteresis": 0.2}
    inside = dict.fromkeys(truth, 0)
    repeats = 600
    for _ in range(repeats):
        data = planted(rng, offset_deg=0.5, gain=1.01, hysteresis_deg=0.2, sd_deg=sd)
        found, _ = regress(data[0], angle_rad=data[1], approach=data[2])
        for name, value in truth.items():
            estimate = found[name]
            assert estimate is not None
            inside[name] += estimate.low <= value <= estimate.high
    low, high = stats.binom.interval(0.999, repeats, 0.95)
    for name, count in inside.items():
        assert low <= count <= high, f"{name}: {count} of {repeats}"


def test_what_the_stops_do_not_tell_is_none() -> None:
    one_angle, _ = regress(np.array([0.1, 0.2, 0.1]), angle_rad=np.ones(3), approach=np.ones(3))
    assert one_angle["offset"] is not None
    assert one_angle["gain"] is None
    assert one_angle["hysteresis"] is None
    too_few, scatter = regress(np.array([0.1]), angle_rad=np.array([1.0]), approach=np.array([1.0]))
    assert too_few == {"offset": None, "gain": None, "hysteresis": None}
    assert math.isnan(scatter)


def test_a_jump_is_counted_and_honest_noise_is_not() -> None:
    rng = np.random.default_rng(4)
    series = {"imu": (0.4 * rng.standard_normal(500)).tolist(), "gauge": [0.0] * 49 + [0.1]}
    series["jumpy"] = [*(0.1 * rng.standard_normal(48)).tolist(), 7.0, -9.0]
    found = compare([stop(0.0, series)])
    assert {fit.source: fit.suspect for fit in found.fits} == {"imu": 0, "gauge": 1, "jumpy": 2}


# --- from messages ----------------------------------------------------------------------------------------------------


def messages_of(angles_deg: list[float], *, azimuth_rad: float = 0.0) -> list[Message]:
    """Commands, windows and one reading of a sensor with three axes at each stop, and one on the way."""
    found: list[Message] = []
    for step, angle_deg in enumerate(angles_deg, start=1):
        t, angle = step * 10**9, math.radians(angle_deg)
        x, y = math.sin(angle) * math.sin(azimuth_rad), -math.sin(angle) * math.cos(azimuth_rad)
        reading = AngleReading(t + 500, "imu", abs(angle), x, y, -math.cos(angle))
        found += [
            TiltCommand(t, 1, 0, azimuth_rad, angle, step),
            AngleReading(t + 50, "imu", 1.5),
            RunEvent(t + 100, 1, "DWELL", "", step),
            reading,
            RunEvent(t + 900, 1, "DONE", "", step),
        ]
    return found


def test_stops_from_messages_have_their_own_readings_and_know_whence_they_were_reached() -> None:
    stops = stops_of(messages_of([0.0, 1.0, 2.0, 1.0, 0.0]))
    assert [stop.approach for stop in stops] == [0, 1, 1, -1, -1]
    read = [np.degrees(stop.series["imu"].angle_rad).tolist() for stop in stops]
    assert read == [[pytest.approx(angle, abs=1e-9)] for angle in (0, 1, 2, 1, 0)]


def test_readings_are_taken_about_the_axis_of_their_stop() -> None:
    stops = stops_of(messages_of([-3.0], azimuth_rad=math.pi / 2))
    assert np.degrees(stops[0].series["imu"].angle_rad).tolist() == [pytest.approx(-3.0)]


def test_late_messages_change_nothing() -> None:
    inorder = messages_of([0.0, 1.0])
    readings = [message for message in inorder if isinstance(message, AngleReading)]
    others = [message for message in inorder if not isinstance(message, AngleReading)]
    for one, other in zip(stops_of(inorder), stops_of(others + readings[::-1]), strict=True):
        assert one.series["imu"].angle_rad.tolist() == other.series["imu"].angle_rad.tolist()


def test_an_answer_without_a_value_is_no_reading() -> None:
    messages = messages_of([1.0])
    stops = stops_of([*messages, AngleReading(10**9 + 600, "gauge", math.nan)])
    assert len(stops[0].series["gauge"].angle_rad) == 0


def test_a_stop_that_was_broken_off_does_not_count() -> None:
    assert len(stops_of(messages_of([0.0, 1.0])[:-1])) == 1
    assert stops_of([]) == ()

"""The system's clock: carried on by the monotonic one, whatever happens while it is set."""

import itertools
import sys

import pytest

from shared import clock


def test_an_interruption_between_two_looks_shifts_nothing(monkeypatch: pytest.MonkeyPatch):
    """A process that had to wait a third of a millisecond there had all its stamps late by as much."""
    started, waits = 5_000_000_000, itertools.chain([300_000, 400_000], itertools.repeat(100))
    passed = [0]

    def perf_counter_ns() -> int:
        passed[0] += 50
        return started + passed[0]

    def time_ns() -> int:
        now_ns = 1_700_000_000_000_000_000 + passed[0]
        passed[0] += next(waits)
        return now_ns

    monkeypatch.setattr(clock.time, "perf_counter_ns", perf_counter_ns)
    monkeypatch.setattr(clock.time, "time_ns", time_ns)
    epoch_ns = clock.SystemClock().from_monotonic_ns(0)
    assert epoch_ns == pytest.approx(1_700_000_000_000_000_000 - started, abs=200)


def test_it_goes_with_the_monotonic_clock():
    ours = clock.SystemClock()
    before = clock.time.perf_counter_ns()
    now_ns = ours.now_ns()
    assert ours.from_monotonic_ns(before) <= now_ns <= ours.from_monotonic_ns(clock.time.perf_counter_ns())


def test_it_tells_frames_apart():
    """Windows' monotonic clock, which tests/elsewhere imitates, gives some thousand looks one or two stamps."""
    ours = clock.SystemClock()
    assert len({ours.now_ns() for _ in range(3000)}) > 100


@pytest.mark.skipif(sys.platform != "linux", reason="cameras that stamp by the monotonic clock are Linux's")
def test_it_is_the_clock_by_which_cameras_stamp():
    assert clock.time.get_clock_info("perf_counter").implementation == "clock_gettime(CLOCK_MONOTONIC)"

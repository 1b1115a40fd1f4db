"""The system's clock: carried on by the monotonic one, whatever happens while it is set."""

import itertools

import pytest

from shared import clock


def test_an_interruption_between_two_looks_shifts_nothing(monkeypatch: pytest.MonkeyPatch):
    """A process that had to wait a third of a millisecond there had all its stamps late by as much."""
    started, waits = 5_000_000_000, itertools.chain([300_000, 400_000], itertools.repeat(100))
    passed = [0]

    def monotonic_ns() -> int:
        passed[0] += 50
        return started + passed[0]

    def time_ns() -> int:
        now_ns = 1_700_000_000_000_000_000 + passed[0]
        passed[0] += next(waits)
        return now_ns

    monkeypatch.setattr(clock.time, "monotonic_ns", monotonic_ns)
    monkeypatch.setattr(clock.time, "time_ns", time_ns)
    epoch_ns = clock.SystemClock().from_monotonic_ns(0)
    assert epoch_ns == pytest.approx(1_700_000_000_000_000_000 - started, abs=200)


def test_it_goes_with_the_monotonic_clock():
    ours = clock.SystemClock()
    before = clock.time.monotonic_ns()
    now_ns = ours.now_ns()
    assert ours.from_monotonic_ns(before) <= now_ns <= ours.from_monotonic_ns(clock.time.monotonic_ns())

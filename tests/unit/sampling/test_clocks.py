"""Offsets of clocks: they hold for ten seconds, in which their error grows."""

from __future__ import annotations

import pytest

from shared.messages import ClockOffset
from station.sampling.clocks import Clocks

SECOND = 1_000_000_000


def known(*, sigma_ns: int = 0) -> Clocks:
    clocks = Clocks()
    for agent in ("camera", "arm"):
        clocks.take(ClockOffset(agent=agent, offset_ns=7, sigma_ns=sigma_ns), now_ns=SECOND)
    return clocks


def test_a_clock_that_nobody_measured_is_not_zero():
    assert Clocks().offset_ns("arm", now_ns=SECOND) is None
    assert Clocks().unknown(now_ns=SECOND) == ("camera", "arm")


def test_an_offset_holds_for_ten_seconds():
    clocks = known()
    assert clocks.offset_ns("arm", now_ns=11 * SECOND) == 7
    assert clocks.unknown(now_ns=11 * SECOND) == ()
    assert clocks.offset_ns("arm", now_ns=12 * SECOND) is None


def test_its_error_is_the_stated_one_until_the_next_offset_is_due_and_grows_then():
    assert known(sigma_ns=30_000).sigma_s(now_ns=3 * SECOND) == pytest.approx(2**0.5 * 30e-6)
    assert known().sigma_s(now_ns=8 * SECOND) == pytest.approx(2**0.5 * 5 * 200e-6)

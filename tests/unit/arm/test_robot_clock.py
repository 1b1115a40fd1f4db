"""Joint states are stamped by the agent's clock, late by the least delay, whatever the robot's clock shows."""

from __future__ import annotations

import numpy as np
import pytest

from station.arm.drivers._robot_clock import Arrivals, RobotClock

MS = 1_000_000
LEAST_NS = 2 * MS
BEGIN_NS = 1_700_000_000_000_000_000


@pytest.mark.parametrize("ahead_ns", [0, 90 * MS, -90 * MS, 3_600_000 * MS, -BEGIN_NS + 5 * MS])
def test_a_clock_that_is_off_shifts_no_stamp(ahead_ns: int) -> None:
    clock = RobotClock()
    delays = LEAST_NS + np.random.default_rng(1).exponential(3 * MS, 600).astype(int)
    late = list[int]()
    for number, delay in enumerate(delays.tolist()):
        taken_ns = BEGIN_NS + 10 * MS * number
        late.append(clock.stamp_ns(taken_ns + ahead_ns, arrived_ns=taken_ns + delay) - taken_ns)
    assert late[-1] == pytest.approx(LEAST_NS, abs=MS // 10)
    assert max(late[100:]) - min(late[100:]) < MS // 5  # without the offset they are the delays, 3 ms apart


def test_a_clock_that_drifts_is_followed() -> None:
    clock = RobotClock()
    for number in range(6000):  # a minute, in which the robot's clock loses 6 ms
        taken_ns = BEGIN_NS + 10 * MS * number
        stamp_ns = clock.stamp_ns(taken_ns - MS * number // 1000, arrived_ns=taken_ns + LEAST_NS)
        assert abs(stamp_ns - taken_ns - LEAST_NS) <= MS // 2


def test_stamps_never_go_back() -> None:
    clock = RobotClock()
    first = clock.stamp_ns(BEGIN_NS, arrived_ns=BEGIN_NS + 50 * MS)
    second = clock.stamp_ns(BEGIN_NS + 10 * MS, arrived_ns=BEGIN_NS + 12 * MS)
    assert second >= first
    assert clock.offset_ns() == LEAST_NS


def test_states_without_stamps_count_by_their_arrival() -> None:
    clock = RobotClock()
    assert clock.stamp_ns(0, arrived_ns=BEGIN_NS) == BEGIN_NS
    assert clock.offset_ns() is None


def test_arrivals_are_told_by_the_agents_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    monotonic = [100 * MS]
    monkeypatch.setattr("time.perf_counter_ns", lambda: monotonic[0])
    arrivals = Arrivals()
    noted = arrivals.now()
    for busy in (3 * MS, 0, 7 * MS):  # the time between the agent's look at its clock and the driver's
        monotonic[0] += 8 * MS + busy
        arrivals.tick(BEGIN_NS + monotonic[0] - busy)
    assert noted + arrivals.ahead_ns() == BEGIN_NS + 100 * MS

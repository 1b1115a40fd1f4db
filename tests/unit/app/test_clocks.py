"""Agents' clocks by round trips: found within what is stated, followed when they step, and used in the recording."""

from __future__ import annotations

from collections import deque
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from shared.bus import ReplyHandler
from shared.clock import SIMULATION_EPOCH_NS, SimulatedClock
from shared.memory_bus import MemoryBus
from shared.messages import ClockOffset, ClockPong, MarkerCorners, Message
from station.app.clocks import ANSWER_S, PING_NS, ClockKeeper, RoundTrip, best_of
from station.recording.provenance import Provenance
from station.recording.reader import open_recording
from station.recording.recorder import record_within
from station.recording.writer import Recording
from station.sampling.clock_step import STEP_NS

SKEW_NS = 7_123_456_789


class Agent:
    """A process whose clock is behind by `skew_ns`, reached over a line with random delays there and back."""

    def __init__(self, bus: MemoryBus, clock: SimulatedClock, *, skew_ns: int, rng: np.random.Generator) -> None:
        self.skew_ns, self._clock, self._rng = skew_ns, clock, rng
        self.silent = False
        bus.serve("camera/clock", self._answer)

    def now_ns(self) -> int:
        return self._clock.now_ns() - self.skew_ns

    def _travel(self) -> None:
        self._clock.advance_to(self._clock.now_ns() + 50_000 + int(self._rng.exponential(1_000_000)))

    def _answer(self, _: Message) -> ClockPong:
        self._travel()
        answer = ClockPong(agent_ns=self.now_ns())
        self._travel()
        return answer


def keep(keeper: ClockKeeper, clock: SimulatedClock, *, seconds: float) -> None:
    end = clock.now_ns() + int(seconds * 1e9)
    while clock.now_ns() < end:
        clock.advance_to(clock.now_ns() + PING_NS)
        keeper.tick(clock.now_ns())


def test_only_the_quickest_round_trip_counts():
    trips = deque([RoundTrip(900, 5000), RoundTrip(100, 120), RoundTrip(-700, 4000)])
    assert best_of(trips) == (RoundTrip(100, 120), 35)


@pytest.mark.parametrize("seed", range(5))
def test_a_skewed_clock_is_found_within_its_stated_sigma(seed: int):
    clock = SimulatedClock()
    bus = MemoryBus(clock)
    offsets: list[ClockOffset] = []
    bus.subscribe("clock", lambda received: offsets.append(received.message))  # pyright: ignore[reportArgumentType]
    Agent(bus, clock, skew_ns=SKEW_NS, rng=np.random.default_rng(seed))
    keep(ClockKeeper(bus, clock=clock, agents=("camera",)), clock, seconds=12)
    assert len(offsets) >= 10
    assert {offset.agent for offset in offsets} == {"camera"}
    errors = [abs(offset.offset_ns - SKEW_NS) / offset.sigma_ns for offset in offsets]
    assert max(errors) <= 12**0.5 / 2 + 1e-3  # half the round trip is the most that it can be off
    assert offsets[-1].sigma_ns < 200_000


def test_an_agent_that_has_not_answered_is_not_asked_again():
    clock, asked, late = SimulatedClock(), list[Message](), list[ReplyHandler]()

    class Slow(MemoryBus):
        def request(self, service: str, message: Message, on_reply: ReplyHandler, **_: object) -> None:  # noqa: ARG002
            asked.append(message)
            late.append(on_reply)

    keeper = ClockKeeper(Slow(clock), clock=clock, agents=("camera",))
    keep(keeper, clock, seconds=ANSWER_S)
    assert len(asked) == 1
    late[0](None)  # the bus has given up waiting
    keep(keeper, clock, seconds=ANSWER_S)
    assert len(asked) == 2
    keep(keeper, clock, seconds=3 * ANSWER_S)  # and here it does not say so
    assert len(asked) == 3


def test_an_agent_that_starts_again_with_another_clock_is_followed_at_once():
    clock = SimulatedClock()
    bus = MemoryBus(clock)
    offsets: list[ClockOffset] = []
    bus.subscribe("clock", lambda received: offsets.append(received.message))  # pyright: ignore[reportArgumentType]
    agent = Agent(bus, clock, skew_ns=SKEW_NS, rng=np.random.default_rng(1))
    keeper = ClockKeeper(bus, clock=clock, agents=("camera",))
    keep(keeper, clock, seconds=5)
    agent.skew_ns = SKEW_NS - 40 * STEP_NS
    keep(keeper, clock, seconds=2.2)
    assert offsets[-1].offset_ns == pytest.approx(agent.skew_ns, abs=1e6)


def test_an_agent_that_answers_no_more_has_no_offset_after_ten_seconds():
    clock = SimulatedClock()
    offsets: list[object] = []

    class Cut(MemoryBus):
        cut = False

        def request(self, service: str, message: Message, on_reply: ReplyHandler, **options: Any) -> None:
            if not self.cut:
                super().request(service, message, on_reply, **options)

    bus = Cut(clock)
    bus.subscribe("clock", offsets.append)
    Agent(bus, clock, skew_ns=SKEW_NS, rng=np.random.default_rng(1))
    keeper = ClockKeeper(bus, clock=clock, agents=("camera",))
    keep(keeper, clock, seconds=5)
    bus.cut = True
    keep(keeper, clock, seconds=11)
    reported = len(offsets)
    keep(keeper, clock, seconds=60)
    assert len(offsets) == reported


def test_an_agent_that_never_answers_has_no_offset():
    clock = SimulatedClock()
    bus = MemoryBus(clock)
    heard: list[object] = []
    bus.subscribe("clock", heard.append)
    keep(ClockKeeper(bus, clock=clock, agents=("camera", "arm")), clock, seconds=3)
    assert heard == []


def test_recorded_publish_times_are_on_the_stations_clock(tmp_path: Path):
    clock = SimulatedClock()
    bus = MemoryBus(clock)
    agent = Agent(bus, clock, skew_ns=SKEW_NS, rng=np.random.default_rng(3))
    path = tmp_path / "session.mcap"
    captured: list[int] = []
    with Recording(path, provenance=Provenance(rig_id="x", started_ns=SIMULATION_EPOCH_NS)) as recording:
        record_within(bus, recording)
        keeper = ClockKeeper(bus, clock=clock, agents=("camera",))
        keep(keeper, clock, seconds=3)
        for seq in range(20):
            keep(keeper, clock, seconds=0.1)
            captured.append(clock.now_ns())
            bus.publish("camera/corners", MarkerCorners(capture_ns=agent.now_ns(), seq=seq))
    found = list(open_recording(path).messages({"camera/corners"}))
    assert [item.publish_ns for item in found] == pytest.approx(captured, abs=500_000)
    raw = [item.message.capture_ns for item in found if isinstance(item.message, MarkerCorners)]
    assert raw == [stamp - SKEW_NS for stamp in captured]

"""A recording played back onto a bus: the same messages, in its own timing, and honest answers to commands."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import pytest

from shared import messages as m
from shared.bus import Received
from shared.clock import SimulatedClock
from shared.errors import UserError
from shared.memory_bus import MemoryBus
from shared.rig import BusConfig
from station.view.playback import Playback, endpoints_of, topics_of
from tests.unit.view import session

ALL = ("camera", "arm", "twin", "station")


@dataclass(frozen=True)
class Item:
    topic: str
    message: m.Message
    log_ns: int


class Stage(MemoryBus):
    """A bus on which waiting moves the clock, so that timing is exact and no time passes."""

    def __init__(self) -> None:
        self.clock = SimulatedClock(0)
        super().__init__(self.clock)
        self.heard: list[tuple[int, Received]] = []
        self.subscribe("**", lambda received: self.heard.append((self.clock.now_ns(), received)))

    def poll(self, timeout_s: float = 0.0) -> int:
        self.clock.advance_to(self.clock.now_ns() + round(timeout_s * 1e9))
        return 0


def items() -> list[Item]:
    return [Item(topic, message, stamp + 2_000_000) for topic, message, stamp in session.session_messages()]


def playback(stage: Stage, *commands: tuple[int, int]) -> Playback:
    return Playback(stage, clock=stage.clock, stand_ins=ALL, commands=commands)


@pytest.mark.parametrize("speed", [1.0, 4.0])
def test_messages_come_unchanged_and_as_far_apart_as_they_were_received(speed: float) -> None:
    stage = Stage()
    recorded = items()
    assert playback(stage).play(recorded, speed=speed, monotonic_ns=stage.clock.now_ns) == len(recorded)
    assert [(heard.topic, heard.message) for _, heard in stage.heard] == [(i.topic, i.message) for i in recorded]
    for (at_ns, _), item in zip(stage.heard, recorded, strict=True):
        assert at_ns == pytest.approx((item.log_ns - recorded[0].log_ns) / speed, abs=10)


@pytest.mark.parametrize("speed", [0.0, -1.0, float("nan")])
def test_a_speed_that_is_none_is_refused(speed: float) -> None:
    with pytest.raises(UserError, match="positive speed"):
        playback(Stage()).play([], speed=speed)


def test_whoever_is_stood_in_for_is_announced() -> None:
    stage = Stage()
    playback(stage)
    assert stage.alive() == frozenset(ALL)


def test_a_command_of_the_recording_is_accepted_and_another_refused_with_the_reason() -> None:
    stage = Stage()
    playback(stage, (1, 2))
    replies: list[m.Message | None] = []
    stage.request("arm/command", m.TiltCommand(run=1, step=2), replies.append)
    stage.request("arm/command", m.TiltCommand(run=1, step=3), replies.append)
    accepted, refused = replies
    assert isinstance(accepted, m.ArmReply)
    assert accepted.accepted
    assert isinstance(refused, m.ArmReply)
    assert not refused.accepted
    assert "run 1, step 3" in refused.reason


def test_clocks_are_answered_with_the_time() -> None:
    stage = Stage()
    playback(stage)
    stage.clock.advance_to(55)
    replies: list[m.Message | None] = []
    stage.request("camera/clock", m.ClockPing(station_ns=7), replies.append)
    assert replies == [m.ClockPong(station_ns=7, agent_ns=55)]


def test_an_emergency_stop_ends_the_playback() -> None:
    stage = Stage()
    player = playback(stage)

    def stopping() -> Iterator[Item]:
        for number, item in enumerate(items()):
            if number == 10:
                stage.request("arm/stop", m.ArmStop(reason="smoke"), lambda _: None)
            yield item

    assert player.play(stopping(), monotonic_ns=stage.clock.now_ns) == 10
    assert player.stopped == "smoke"


def test_progress_is_told_every_second() -> None:
    stage = Stage()
    seconds: list[float] = []
    playback(stage).play(items(), on_second=seconds.append, monotonic_ns=stage.clock.now_ns)
    assert [int(second) for second in seconds] == [1, 2, 3, 4]


def test_only_the_topics_of_those_stood_in_for_are_played() -> None:
    names = ["camera/corners", "arm/platform", "session/event", "log", "angle/imu", "truth/scene", "nobody/knows"]
    assert topics_of(names, stand_ins=("camera",)) == {"camera/corners", "log", "angle/imu"}
    assert topics_of(names, stand_ins=ALL) == set(names) - {"truth/scene", "nobody/knows"}


@pytest.mark.parametrize(
    ("stand_ins", "listen", "connect"),
    [
        (ALL, ("c", "a", "t", "s"), ()),
        (("camera", "arm"), ("c", "a"), ()),
        (("arm",), ("a",), ("c",)),
        (("station",), ("s",), ("c", "a", "t")),
    ],
)
def test_every_pair_of_processes_has_one_link(
    stand_ins: tuple[str, ...], listen: tuple[str, ...], connect: tuple[str, ...]
) -> None:
    at = endpoints_of(BusConfig(camera="c", arm="a", twin="t", station="s"), stand_ins=stand_ins)
    assert (at.listen, at.connect) == (listen, connect)

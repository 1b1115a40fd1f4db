"""A second station with valid keys: the first hears nothing of it, and the arm, which it reaches, does not obey it."""

from __future__ import annotations

import contextlib
import math
import shutil
import time
from collections.abc import Callable, Generator
from pathlib import Path

import pytest

from shared.bus import Received
from shared.config import Table
from shared.messages import ArmReply, Heartbeat, JointState, JointTarget, LeaseRequest, Message, TiltCommand
from shared.rig import RigConfig, rig_of_table
from shared.topics import SERVICES, TOPICS
from shared.zenoh_bus import ZenohBus
from station.app import authority
from station.arm.agent import ArmAgent, arm_agent
from station.rig.arm_model import load_arm_model
from station.rig.arm_settings import ArmSettings
from tests.contracts.least import least
from tests.patience import PATIENCE_S
from tests.system.ports import free_port

TRIES = 5
BEAT_S = 0.1


class Arm:
    """The real agent of an arm that goes where it is told, on the real bus."""

    def __init__(self, bus: ZenohBus) -> None:
        self.bus = bus
        self.agent: ArmAgent = arm_agent(bus, ArmSettings())
        model = load_arm_model("jaco2_spherical")
        self._names, self._position = model.joint_names, model.home_rad
        self.moved = False
        bus.subscribe("twin/target", self._follow)

    def _follow(self, received: Received) -> None:
        assert isinstance(received.message, JointTarget)
        self.moved = self.moved or math.dist(received.message.position_rad, self._position) > 0.0
        self._position = received.message.position_rad

    def tick(self) -> None:
        now_ns, still = time.time_ns(), (0.0,) * len(self._names)
        self.bus.publish("twin/joints", JointState(now_ns, self._names, self._position, still, ()))
        self.agent.tick(now_ns)


class Lab:
    """Arm agent and two stations, of which the first is alive as session `first`."""

    def __init__(self, arm: ZenohBus, first: ZenohBus, second: ZenohBus) -> None:
        self.arm, self.first, self.second = Arm(arm), first, second
        self.heard: list[Received] = []
        first.subscribe("**", self.heard.append)
        self._beaten_s = 0.0

    def until(self, holds: Callable[[], bool]) -> None:
        end = time.monotonic() + PATIENCE_S
        while not holds():
            assert time.monotonic() < end
            self.turn()

    def turn(self) -> None:
        if time.monotonic() > self._beaten_s + BEAT_S:
            self._beaten_s = time.monotonic()
            self.first.publish("session/heartbeat", Heartbeat(time.time_ns(), True, "first"))
        self.arm.tick()
        for bus in (self.arm.bus, self.first, self.second):
            bus.poll(0.005)

    def asked(self, bus: ZenohBus, service: str, message: Message) -> ArmReply:
        """Returns the arm's answer."""
        replies: list[Message | None] = []
        bus.request(service, message, replies.append, timeout_s=PATIENCE_S)
        self.until(lambda: bool(replies))
        assert isinstance(replies[0], ArmReply)
        return replies[0]


def tilt(owner: str) -> TiltCommand:
    return TiltCommand(time.time_ns(), run=1, angle_rad=0.1, step=1, rate_rad_s=0.1, owner=owner)


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Generator[Lab]:
    at: dict[str, object] = {name: f"tls/127.0.0.1:{free_port()}" for name in ("arm", "station")}
    rig: RigConfig = rig_of_table(Table({"id": "rights", "bus": at}))
    authority.new_authority(rig, tmp_path / "keys")
    shutil.copytree(tmp_path / "keys" / "station", tmp_path / "keys" / "copied")
    monkeypatch.setenv("REPOSE_KEYS", str(tmp_path / "keys"))
    with contextlib.ExitStack() as stack:
        arm, first = (stack.enter_context(ZenohBus.of(name, rig)) for name in ("arm", "station"))
        # On a computer of its own it has the same keys, and listens elsewhere.
        connect = (*rig.bus.endpoint("arm"), *rig.bus.endpoint("station"))
        second = stack.enter_context(ZenohBus(rig.id, connect=connect, process="station"))
        made = Lab(arm, first, second)
        first.announce("station")
        second.announce("station")
        made.until(lambda: "arm" in first.alive() and "arm" in second.alive())
        assert made.asked(first, "arm/lease", LeaseRequest(time.time_ns(), "first")).accepted
        yield made


def test_nothing_that_it_sends_or_asks_gets_through_and_both_ends_say_so(
    lab: Lab, caplog: pytest.LogCaptureFixture
) -> None:
    answers: list[Message | None] = []
    for _ in range(TRIES):
        for topic in TOPICS:
            lab.second.publish(topic, least(topic))
        lab.second.publish("session/heartbeat", Heartbeat(time.time_ns(), True, "second"))
        for service in sorted(SERVICES.keys() - {"arm/stop", "arm/clock"}):  # those that anybody may ask the arm
            lab.second.request(service, SERVICES[service].request(), answers.append, timeout_s=1.0)
        for owner in ("second", ""):
            assert "belongs to another session (first)" in lab.asked(lab.second, "arm/command", tilt(owner)).reason
        refused = lab.asked(lab.second, "arm/lease", LeaseRequest(time.time_ns(), "second"))
        assert "belongs to another session (first)" in refused.reason
    lab.until(lambda: len(answers) == TRIES * (len(SERVICES) - 2))
    assert not [reply for reply in answers if isinstance(reply, ArmReply) and reply.accepted]
    assert not lab.arm.moved
    assert {TOPICS[one.topic].sender for one in lab.heard if one.topic != "session/heartbeat"} <= {"arm", "any"}
    assert {one.message.owner for one in lab.heard if isinstance(one.message, Heartbeat)} <= {"first"}
    said = [record.getMessage() for when in ("setup", "call") for record in caplog.get_records(when)]
    assert len([line for line in said if "Refused: another station process" in line]) == 2
    lab.until(lambda: lab.asked(lab.first, "arm/command", tilt("first")).accepted)  # once its heartbeat has armed it
    lab.until(lambda: lab.arm.moved)

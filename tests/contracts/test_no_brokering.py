"""No process forwards for others: a stranger at one process's port meets that process and nobody behind it."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import Any

import pytest
import zenoh

from shared import wire
from shared.bus import Received
from shared.messages import ArmReply, CameraGeometry, Heartbeat, Message, Sample, TiltCommand
from shared.zenoh_bus import ZenohBus
from tests.contracts.test_bus import endpoint, settled

FORGED = {"session/heartbeat": Heartbeat(armed=True), "session/sample": Sample(run=666)}
GATEWAYS: tuple[dict[str, Any], ...] = ({}, {"gateway": {"south": [{}]}})
"""A stranger may also claim that it is the way to a region of its own."""


@dataclass
class Rig:
    """Camera, arm and station on their buses, and what a stranger can do to them."""

    at: str
    camera: ZenohBus
    arm: ZenohBus
    station: ZenohBus
    reached: list[str] = field(default_factory=list[str])

    def wait(self, happened: Callable[[], bool]) -> None:
        end = time.monotonic() + 30.0
        while not happened():
            assert time.monotonic() < end, "it did not come to pass"
            for bus in (self.camera, self.arm, self.station):
                bus.poll(0.005)


@pytest.fixture
def rig() -> Generator[Rig]:
    at, arms = endpoint(), endpoint()
    with (
        ZenohBus("rig", listen=[at]) as camera,
        ZenohBus("rig", listen=[arms], connect=[at]) as arm,
        ZenohBus("rig", listen=[endpoint()], connect=[at, arms]) as station,
    ):
        rig = Rig(at, camera, arm, station)

        def commanded(_: Message) -> ArmReply:
            rig.reached.append("arm/command")
            return ArmReply(accepted=True)

        arm.serve("arm/command", commanded)
        arm.subscribe("session/heartbeat", lambda received: rig.reached.append(received.topic))
        station.subscribe("session/sample", lambda received: rig.reached.append(received.topic))
        settled(camera, station)
        settled(arm, station)
        yield rig


def stranger(at: str, mode: str, gateway: dict[str, Any]) -> zenoh.Session:
    config = zenoh.Config()
    quiet = {"scouting/multicast/enabled": False, "scouting/gossip/enabled": False, "listen/endpoints": []}
    settings = {"mode": mode, "connect/endpoints": [at], "connect/timeout_ms": 2000, **quiet, **gateway}
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


def test_a_client_is_turned_away(rig: Rig) -> None:
    """Zenoh forwards for clients alone, and has no client whose messages are not forwarded."""
    with pytest.raises(zenoh.ZError, match="Unable to connect"):
        stranger(rig.at, "client", {})


@pytest.mark.parametrize("gateway", GATEWAYS, ids=["plain", "as a gateway"])
@pytest.mark.parametrize("mode", ["peer", "router"])
def test_who_reaches_the_camera_reaches_nobody_behind_it(rig: Rig, mode: str, gateway: dict[str, Any]) -> None:
    """The stranger hears in the end what was sent after all that it tried: nothing of that is still on its way."""
    heard, replies, seen = list[str](), list[Any](), list[Received]()
    rig.camera.subscribe("session/heartbeat", seen.append)
    with stranger(rig.at, mode, gateway) as session:
        session.declare_subscriber("**", lambda sample: heard.append(str(sample.key_expr)))
        session.liveliness().declare_token("repose/rig/@alive/arm")

        def try_it() -> bool:
            for name, message in FORGED.items():
                session.put(f"repose/rig/{name}", wire.encode(message))
            session.get("repose/rig/arm/command", replies.append, payload=wire.encode(TiltCommand(angle_rad=0.4)))
            rig.station.publish("session/event", Sample())
            rig.camera.publish("camera/geometry", CameraGeometry())
            return len(seen) > 20 and "repose/rig/camera/geometry" in heard

        rig.wait(try_it)
        # The camera answers on the way that everything of the stranger's would have taken; then the others' turn ends.
        settled(rig.camera, rig.station)
        settled(rig.arm, rig.station)
    assert rig.reached == []
    assert [reply for reply in replies if reply.ok is not None] == []
    assert "arm" not in rig.station.alive()
    assert "repose/rig/session/event" not in heard

"""A payload that is no message of its topic, whoever sent it: counted, left out, and nobody ends of it."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Generator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import pytest

from shared import topics, wire
from shared.bus import Received
from shared.errors import UserError
from shared.foxglove import CameraCalibration, FrameTransforms, Log, Timestamp
from shared.messages import (
    AgentStatus,
    AngleReading,
    ArmReply,
    BlockPose,
    CameraGeometry,
    Environment,
    JointState,
    JointTarget,
    MarkerCorners,
    Message,
    MotionReport,
    PlatformState,
    Sample,
    SessionStatus,
    TiltCommand,
    TwinScene,
)
from shared.visible import LONGEST, shortened
from shared.zenoh_bus import RawSession, ZenohBus
from tests.contracts.least import least
from tests.contracts.test_bus import endpoint
from tests.patience import PATIENCE_S

JUNK = b"\xff" * 13
"""No protobuf of any class: the tag's number never ends."""
IMPOSSIBLE: tuple[Message, ...] = (
    MarkerCorners(corners_px=(1.0, 2.0), found=True),
    MarkerCorners(corners_px=(float("nan"),) * 8, found=True),
    PlatformState(qw=0.0),
    PlatformState(qw=float("inf")),
    PlatformState(qw=1e-320),
    PlatformState(qw=1e200),
    PlatformState(qw=0.4),
    PlatformState(px=float("nan"), wx=float("inf")),
    PlatformState(pz=1e300),
    PlatformState(py=101.0),
    MarkerCorners(corners_px=(1e300,) * 8, found=True),
    MarkerCorners(corners_px=(1.0,) * 8, sigma_px=float("nan"), found=True),
    BlockPose(x=float("inf"), found=True),
    JointState(position_rad=(1e308,)),
    JointTarget(position_rad=(1e308,), velocity_rad_s=(0.0,)),
    AngleReading(angle_rad=float("nan")),
    Environment(temperature_c=float("inf")),
    AgentStatus(rate_hz=1e300),
    SessionStatus(slip_base_px=float("nan")),
    SessionStatus(total=2**40),
    TwinScene(px=1e300),
    Sample(onset_angle_rad=1e300),
    Sample(euler_rad=(0.0, 0.0, float("inf"))),
    Sample(block_mass_kg=float("nan")),
    Sample(block_area_m2=1e-300),
    TwinScene(block_qw=0.0),
    CameraGeometry(plate_from_pixel=(1.0,) * 8),
    CameraGeometry(plate_from_pixel=(1.0,) * 9),
    CameraGeometry(plate_from_pixel=(0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)),
    CameraGeometry(mm_per_px=float("nan")),
    CameraGeometry(mark_height_m=0.03, camera_height_m=0.03),
    CameraGeometry(mark_height_m=-0.03),
    CameraCalibration(K=(1.0,) * 8),
    CameraCalibration(D=(0.1,) * 8, K=(1.0,) * 9),
    CameraCalibration(D=(0.1,) * 5),
    CameraCalibration(D=(0.1,) * 5, K=(0.0,) * 9),
    CameraCalibration(K=(float("nan"),) * 9),
    BlockPose(qw=0.0, found=True),
    JointState(name=("a", "b"), position_rad=(1.0,)),
    JointState(stamp_ns=1),
    JointTarget(position_rad=(1.0,), velocity_rad_s=()),
    JointTarget(stamp_ns=1),
    JointTarget(position_rad=(float("nan"),), velocity_rad_s=(0.0,)),
    TiltCommand(angle_rad=float("nan")),
    Sample(run=1, euler_rad=(0.0,)),
    Sample(run=-1),
)


@dataclass(frozen=True)
class Network:
    """A bus, and a stranger that reaches it with plain bytes."""

    bus: ZenohBus
    stranger: RawSession

    def put(self, name: str, payload: bytes) -> None:
        self.stranger.put(f"repose/rig/{name}", payload)

    def wait(self, happened: Callable[[], bool]) -> None:
        end = time.monotonic() + PATIENCE_S
        while not happened():
            assert time.monotonic() < end, "it did not come to pass"
            self.bus.poll(0.01)


@pytest.fixture
def network() -> Generator[Network]:
    at = endpoint()
    with ZenohBus("rig", listen=[at]) as bus:
        stranger = RawSession(connect=[at], mode="peer")
        yield Network(bus, stranger)
        stranger.close()


@pytest.mark.parametrize("junk", [JUNK, b""], ids=["junk", "empty"])
@pytest.mark.parametrize("name", topics.TOPICS)
def test_junk_on_a_topic_reaches_nobody(
    network: Network, name: str, junk: bytes, caplog: pytest.LogCaptureFixture
) -> None:
    heard, recorded = list[Received](), list[Received]()
    network.bus.subscribe(name, heard.append)
    network.bus.subscribe(name, recorded.append, direct=True)
    good = wire.encode(least(name))

    def one_came() -> bool:
        network.put(name, junk)
        network.put(name, good)
        return bool(heard) and network.bus.malformed[name] > 0

    with caplog.at_level(logging.WARNING):
        network.wait(one_came)
    assert {received.payload for received in [*heard, *recorded]} == {good}
    assert network.bus.malformed[name] >= 1
    assert f"malformed messages on {name}" in caplog.text


def test_a_message_under_the_key_of_another_topic_reaches_nobody(network: Network) -> None:
    """Zenoh does so with the first messages after a link that was lost, and most parse as what they are not."""
    heard = list[Received]()
    network.bus.subscribe("camera/corners", heard.append)
    plate = wire.encode(MarkerCorners(corners_px=(1.0,) * 8, found=True))
    mark = wire.encode(MarkerCorners(corners_px=(2.0,) * 8, found=True))

    def both_came() -> bool:
        network.stranger.put("repose/rig/camera/corners", plate, attachment=b"camera/plate")
        network.stranger.put("repose/rig/camera/corners", mark, attachment=b"camera/corners")
        return bool(heard) and network.bus.malformed["camera/corners"] > 0

    network.wait(both_came)
    assert {received.payload for received in heard} == {mark}


def test_a_question_under_the_key_of_another_service_is_not_answered(network: Network) -> None:
    asked = list[Message]()

    def serve(message: Message) -> Message:
        asked.append(message)
        return ArmReply()

    network.bus.serve("arm/command", serve)
    query = network.stranger._session.get  # pyright: ignore[reportPrivateUsage]: as below

    def left_out() -> bool:
        query("repose/rig/arm/command", lambda _: None, payload=b"", attachment=b"arm/stop", timeout=20.0)
        return network.bus.malformed["arm/command"] > 0

    network.wait(left_out)
    assert not asked


@pytest.mark.parametrize("name", [*topics.TOPICS, *topics.SERVICES])
def test_what_is_sent_carries_its_name_beside_its_key(name: str) -> None:
    at, names = endpoint(), list[bytes]()
    with ZenohBus("rig", listen=[at]) as bus:
        stranger = RawSession(connect=[at], mode="peer")
        if name in topics.TOPICS:
            stranger.subscribe(f"repose/rig/{name}", lambda _, attachment: names.append(attachment))
        else:
            session = stranger._session  # pyright: ignore[reportPrivateUsage]: as below
            session.declare_queryable(f"repose/rig/{name}", lambda query: names.append(_attached(query)))
        end = time.monotonic() + PATIENCE_S
        while not names and time.monotonic() < end:
            if name in topics.TOPICS:
                bus.publish(name, least(name))
            else:
                bus.request(name, topics.SERVICES[name].request(), lambda _: None, timeout_s=5.0)
            bus.poll(0.02)
        stranger.close()
    assert set(names) == {name.encode()}


def _attached(query: Any) -> bytes:
    return query.attachment.to_bytes() if query.attachment else b""


@pytest.mark.parametrize("name", topics.SERVICES)
def test_junk_as_a_question_is_not_answered(network: Network, name: str) -> None:
    """The server goes on: what is asked well is answered afterwards."""
    line, asked = topics.SERVICES[name], list[Message]()

    def serve(message: Message) -> Message:
        asked.append(message)
        return line.reply()

    network.bus.serve(name, serve)
    query = network.stranger._session.get  # pyright: ignore[reportPrivateUsage]: the library itself, as a stranger has it

    def asks(payload: bytes, happened: Callable[[], bool]) -> bool:
        query(f"repose/rig/{name}", lambda _: None, payload=payload, timeout=20.0)
        return happened()

    network.wait(lambda: asks(JUNK, lambda: network.bus.malformed[name] > 0))
    assert not asked
    network.wait(lambda: asks(wire.encode(line.request()), lambda: bool(asked)))


def test_an_answer_that_is_none_counts_as_none(network: Network) -> None:
    at, replies = endpoint(), list[Message | None]()
    with ZenohBus("rig", listen=[at]) as asker:
        server = RawSession(connect=[at], mode="peer")
        key = "repose/rig/arm/command"
        session = server._session  # pyright: ignore[reportPrivateUsage]: as above
        answering: Any = session.declare_queryable(key, partial(_answer_junk, key))
        end = time.monotonic() + PATIENCE_S
        while not (asker.malformed and replies) and time.monotonic() < end:
            asker.request("arm/command", TiltCommand(), replies.append, timeout_s=5.0)
            asker.poll(0.01)
        answering.undeclare()
        server.close()
        assert set(replies) == {None}
        assert asker.malformed["arm/command"] > 0


def _answer_junk(key: str, query: Any) -> None:
    query.reply(key, JUNK)


@pytest.mark.parametrize("message", IMPOSSIBLE, ids=lambda message: type(message).__name__)
def test_what_parses_and_cannot_be_is_no_message(message: Message) -> None:
    with pytest.raises(UserError, match=f"Expected a {wire.schema_name(type(message))}, got "):
        wire.decode(type(message), wire.encode(message))


FAR = Timestamp(seconds=1 << 35)
"""A time, in ns, that neither the 63 bits of our own stamps hold nor the 64 of a recording's."""


@pytest.mark.parametrize("name", [name for name, topic in topics.TOPICS.items() if topic.message.PACKAGE == "foxglove"])
def test_a_time_that_no_recording_holds_is_none(name: str) -> None:
    message: Any = least(name)
    if isinstance(message, FrameTransforms):
        far: Message = FrameTransforms((replace(message.transforms[0], timestamp=FAR),))
    else:
        far = replace(message, timestamp=FAR)
    with pytest.raises(UserError, match=r"Expected a foxglove\..*, got \(34359738368000000000,\) ns as a time"):
        wire.decode(type(message), wire.encode(far))


@pytest.mark.parametrize(
    "message",
    [
        Sample(run=1, temperature_c=float("nan"), relative_humidity=float("nan")),
        Environment(relative_humidity=float("nan")),
        AgentStatus(temperature_c=float("nan")),
        JointState(position_rad=(0.5,), effort_nm=(float("nan"),)),
        MarkerCorners(sigma_px=float("nan"), found=False),
    ],
    ids=lambda message: type(message).__name__,
)
def test_what_nobody_measured_may_be_nan(message: Message) -> None:
    assert message.impossible() == ""


@pytest.mark.parametrize("name", topics.TOPICS)
def test_what_a_sender_leaves_at_its_defaults_is_possible(name: str) -> None:
    assert least(name).impossible() == ""
    assert ArmReply().impossible() == ""


@pytest.mark.parametrize("name", topics.TOPICS)
def test_an_empty_payload_is_no_message(name: str) -> None:
    with pytest.raises(UserError, match=r"Expected a \w+\.\w+, got an empty payload"):
        wire.decode(topics.topic(name).message, b"")


def test_an_emergency_stop_needs_no_words(network: Network) -> None:
    stopped = list[Message]()

    def serve(message: Message) -> Message:
        stopped.append(message)
        return ArmReply(accepted=True)

    network.bus.serve("arm/stop", serve)
    query = network.stranger._session.get  # pyright: ignore[reportPrivateUsage]: as above

    def heard() -> bool:
        query("repose/rig/arm/stop", lambda _: None, payload=b"", timeout=20.0)
        return bool(stopped)

    network.wait(heard)


def test_long_texts_are_heard_without_their_middle_and_recorded_as_they_were_sent(network: Network) -> None:
    fault = "it stalls" + " z" * 100_000 + ": look at the arm"
    sent = {
        "arm/motion": MotionReport(stamp_ns=1, run=1, fault=fault),
        "session/sample": Sample(run=1, flags=("a", fault)),
        "log": Log(message=fault),
    }
    heard = dict[str, Received]()
    for name in sent:
        network.bus.subscribe(name, lambda received: heard.update({received.topic: received}))

    def all_came() -> bool:
        for name, message in sent.items():
            network.put(name, wire.encode(message))
        return heard.keys() == sent.keys()

    network.wait(all_came)
    assert {name: received.payload for name, received in heard.items()} == {
        name: wire.encode(message) for name, message in sent.items()
    }
    messages: Any = {name: received.message for name, received in heard.items()}
    texts = [messages["arm/motion"].fault, messages["session/sample"].flags[1], messages["log"].message]
    assert set(texts) == {shortened(fault)}
    assert texts[0].startswith("it stalls z")
    assert texts[0].endswith("z: look at the arm")
    assert len(texts[0]) <= LONGEST

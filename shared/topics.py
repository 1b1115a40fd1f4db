"""The one table of everything on the bus: it drives publishing, recording, rates and tests.

A topic is the bus key without the rig's prefix: `repose/<rig id>/camera/corners` carries `camera/corners`, and is
recorded as `/camera/corners`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cache
from operator import attrgetter
from typing import Any, Literal

from shared import foxglove
from shared import messages as m
from shared.errors import UserError


@dataclass(frozen=True, slots=True)
class Traffic:
    """A class of service on the bus.

    `priority` is Zenoh's number (1 highest, 7 lowest); messages of one priority share a pipeline, so classes that may
    block stand apart from those that drop. `cache` samples are kept for recovery after a cut link (0: not recovered).
    """

    name: str
    priority: int
    drop: bool
    cache: int = 0


STOP = Traffic("stop", priority=1, drop=False)
COMMAND = Traffic("command", priority=2, drop=False)
STATE = Traffic("state", priority=3, drop=True)
CORNERS = Traffic("corners", priority=4, drop=False, cache=2700)  # 30 s at 90 Hz
EVENT = Traffic("event", priority=5, drop=False, cache=1000)
STATUS = Traffic("status", priority=6, drop=True)
IMAGE = Traffic("image", priority=7, drop=True)

Sender = Literal["camera", "arm", "station", "twin", "any"]


@dataclass(frozen=True, slots=True)
class Topic:
    """One line of the table; `rate_hz` is the least one; 0: none is promised, as it comes on change or request.

    What is not `recorded` is a simulator's own wire, whose content other topics hold as well.
    """

    name: str
    message: type[m.Message]
    traffic: Traffic
    sender: Sender
    rate_hz: float
    meaning: str
    recorded: bool = True


@dataclass(frozen=True, slots=True)
class Service:
    """A question with an answer; `server` is the process that answers, `asker` the one that may ask."""

    name: str
    request: type[m.Message]
    reply: type[m.Message]
    traffic: Traffic
    server: Sender
    meaning: str
    asker: Sender = "station"


_TOPICS = (
    Topic("camera/corners", m.MarkerCorners, CORNERS, "camera", 90, "the block's marker, every frame"),
    Topic("camera/plate", m.MarkerCorners, CORNERS, "camera", 10, "a fiducial fixed to the plate"),
    Topic("camera/image", foxglove.CompressedImage, IMAGE, "camera", 0, "preview, or every frame on request"),
    Topic("camera/calibration", foxglove.CameraCalibration, STATUS, "camera", 1, "intrinsics and distortion"),
    Topic("camera/geometry", m.CameraGeometry, STATUS, "camera", 1, "what turns pixels into places on the plate"),
    Topic("camera/status", m.AgentStatus, STATUS, "camera", 1, "how the camera agent is doing"),
    Topic(
        "camera/image/overlay", foxglove.PointCloud, IMAGE, "camera", 0, "the corners, drawn over the image by viewers"
    ),
    Topic("block/pose", m.BlockPose, CORNERS, "any", 90, "the block by another tracker"),
    Topic("arm/joints", m.JointState, STATE, "arm", 100, "the arm's joints as measured"),
    Topic("arm/platform", m.PlatformState, STATE, "arm", 100, "the plate's attitude by forward kinematics"),
    Topic("arm/command", m.TiltCommand, EVENT, "station", 0, "what the arm was asked for"),
    Topic("arm/reply", m.ArmReply, EVENT, "station", 0, "what the arm answered, or that it did not"),
    Topic("arm/motion", m.MotionReport, EVENT, "arm", 0, "begin and end of each motion as executed"),
    Topic("arm/lease", m.ArmLease, STATUS, "arm", 1, "which session has the arm, and its emergency stop"),
    Topic("environment", m.Environment, STATUS, "any", 1, "temperature and humidity"),
    Topic("session/event", m.RunEvent, EVENT, "station", 0, "phases of a run"),
    Topic("session/sample", m.Sample, EVENT, "station", 0, "one run's result"),
    Topic("session/heartbeat", m.Heartbeat, COMMAND, "station", 10, "the station is alive"),
    Topic("session/pause", m.SessionPause, EVENT, "station", 0, "no further run begins until it is taken back"),
    Topic("session/status", m.SessionStatus, STATUS, "station", 1, "how far the session is"),
    Topic("clock", m.ClockOffset, STATUS, "station", 1, "agent clocks against the station's"),
    Topic("tf", foxglove.FrameTransforms, STATUS, "station", 30, "world > platform > camera, block"),
    Topic("log", foxglove.Log, EVENT, "any", 0, "one line an event, warnings and errors"),
    Topic("twin/target", m.JointTarget, STATE, "arm", 100, "joint set-points for the twin", recorded=False),
    Topic("twin/joints", m.JointState, STATE, "twin", 180, "the twin's joints", recorded=False),
    Topic("truth/scene", m.TwinScene, STATE, "twin", 180, "what the synthetic camera may see"),
)
_SERVICES = (
    Service("arm/command", m.TiltCommand, m.ArmReply, COMMAND, "arm", "tilt the plate"),
    Service("arm/stop", m.ArmStop, m.ArmReply, STOP, "arm", "emergency stop", asker="any"),
    Service("arm/lease", m.LeaseRequest, m.ArmReply, COMMAND, "arm", "have the arm, alone"),
    Service("session/control", m.SessionRequest, m.SessionReply, COMMAND, "station", "pause, go on, stop", asker="any"),
    Service("camera/clock", m.ClockPing, m.ClockPong, STATUS, "camera", "the camera agent's clock", asker="any"),
    Service("arm/clock", m.ClockPing, m.ClockPong, STATUS, "arm", "the arm agent's clock", asker="any"),
    Service("camera/frames", m.FrameRequest, m.FrameReply, COMMAND, "camera", "full frames around an event"),
)

TOPICS = {topic.name: topic for topic in _TOPICS}
SERVICES = {service.name: service for service in _SERVICES}
ANGLE_PREFIX = "angle/"


def known(name: str) -> bool:
    """Returns true if this version has a message for the topic; a newer process may send others."""
    return name in TOPICS or (name.startswith(ANGLE_PREFIX) and len(name) > len(ANGLE_PREFIX))


def topic(name: str) -> Topic:
    """Returns the table's line for a topic; `angle/<source>` is made on demand, because users add sources.

    Raises:
        UserError: if there is no such topic.
    """
    if name in TOPICS:
        return TOPICS[name]
    if known(name):
        return Topic(name, m.AngleReading, STATE, "any", 0, "another angle sensor")
    raise UserError(
        f"Expected a topic of shared/topics.py, got '{name}'; known are {', '.join(TOPICS)}, angle/<source>"
    )


def capture_ns(message: m.Message) -> int:
    """Returns the time at which the message happened, in nanoseconds, on the clock of its sender."""
    return capture_of(type(message))(message)


@cache
def capture_of(cls: type[m.Message]) -> Callable[[Any], int]:
    """Returns the function that returns this time for messages of one class, for callers that read many."""
    if cls is m.MarkerCorners:
        return attrgetter("capture_ns")
    if cls is m.Sample:
        return attrgetter("detect_ns")
    if cls is foxglove.FrameTransforms:
        return lambda message: message.transforms[0].timestamp.ns if message.transforms else 0
    names = {spec.name for spec in fields(cls)}
    if "timestamp" in names:
        return attrgetter("timestamp.ns")
    return attrgetter("stamp_ns") if "stamp_ns" in names else lambda _: 0

"""The arm under test, and an arm that follows its set-points exactly."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from shared.bus import Received
from shared.clock import SimulatedClock
from shared.geometry import tilt_of
from shared.memory_bus import MemoryBus
from shared.messages import (
    ArmReply,
    ArmStop,
    Heartbeat,
    JointState,
    JointTarget,
    LeaseRequest,
    Message,
    MotionReport,
    PlatformState,
    TiltCommand,
)
from station.arm.agent import ArmAgent, arm_agent
from station.arm.kept import Kept
from station.arm.tilt_path import TiltStage, tilt_stage
from station.rig.arm_model import ArmModel, load_arm_model
from station.rig.arm_settings import ArmSettings

TICK_NS = 10_000_000


@pytest.fixture(scope="session")
def model() -> ArmModel:
    return load_arm_model("jaco2_spherical")


@pytest.fixture(scope="session")
def stage(model: ArmModel) -> TiltStage:
    return tilt_stage(model, base_xyz_m=(0.0, 0.0, 0.0), base_yaw_rad=0.0, home_rad=model.home_rad)


class FakeRig:
    """An arm agent in simulated time with an arm that goes where it is told; `disturb` changes what it measures."""

    def __init__(self, settings: ArmSettings, *, kept: Kept | None = None) -> None:
        self.clock = SimulatedClock()
        self.bus = MemoryBus(self.clock)
        self.agent: ArmAgent = arm_agent(self.bus, settings, kept=kept)
        model = load_arm_model(settings.model)
        self.names = model.joint_names
        self.position: tuple[float, ...] = model.home_rad
        self.velocity: tuple[float, ...] = (0.0,) * len(self.names)
        self.targets: list[JointTarget] = []
        self.motions: list[MotionReport] = []
        self.messages: list[Message] = []
        self.disturb: Callable[[NDArray[np.float64]], NDArray[np.float64]] = lambda joints: joints
        self.silent = False
        self.bus.subscribe("twin/target", self._follow)
        self.bus.subscribe("**", lambda received: self.messages.append(received.message))
        self._ticks = 0

    def _follow(self, received: Received) -> None:
        target = received.message
        assert isinstance(target, JointTarget)
        self.targets.append(target)
        self.position, self.velocity = target.position_rad, target.velocity_rad_s

    def advance(self, seconds: float, *, heartbeat: bool = True, armed: bool = True, owner: str = "") -> None:
        for _ in range(round(seconds * 1e9 / TICK_NS)):
            self.clock.advance_to(self.clock.now_ns() + TICK_NS)
            now_ns = self.clock.now_ns()
            if not self.silent:
                measured = tuple(self.disturb(np.array(self.position)).tolist())
                self.bus.publish("twin/joints", JointState(now_ns, self.names, measured, self.velocity, ()))
            if heartbeat and self._ticks % 10 == 0:
                self.bus.publish("session/heartbeat", Heartbeat(now_ns, armed, owner))
            self._ticks += 1
            self.agent.tick(now_ns)

    def command(
        self,
        angle_deg: float,
        *,
        direction: int = 0,
        rate_deg_s: float = 10.0,
        azimuth_deg: float = 0.0,
        owner: str = "",
    ) -> ArmReply:
        command = TiltCommand(
            self.clock.now_ns(),
            run=1,
            direction=direction,
            azimuth_rad=math.radians(azimuth_deg),
            angle_rad=math.radians(angle_deg),
            step=1,
            rate_rad_s=math.radians(rate_deg_s),
            owner=owner,
        )
        return self._ask("arm/command", command)

    def claim(self, owner: str, *, take_over: bool = False) -> ArmReply:
        return self._ask("arm/lease", LeaseRequest(self.clock.now_ns(), owner, take_over))

    def stop(self, reason: str) -> ArmReply:
        return self._ask("arm/stop", ArmStop(self.clock.now_ns(), reason))

    def _ask(self, service: str, message: Message) -> ArmReply:
        replies: list[Message | None] = []
        self.bus.request(service, message, replies.append)
        assert isinstance(replies[0], ArmReply)
        return replies[0]

    def of(self, kind: type[Message]) -> list[Message]:
        return [message for message in self.messages if isinstance(message, kind)]

    @property
    def reports(self) -> list[MotionReport]:
        return [message for message in self.messages if isinstance(message, MotionReport)]


def last_platform(rig: FakeRig) -> PlatformState:
    """Returns the attitude that was published last."""
    state = rig.of(PlatformState)[-1]
    assert isinstance(state, PlatformState)
    return state


def tilt_deg(rig: FakeRig) -> float:
    """Returns the plate's tilt by that attitude."""
    state = last_platform(rig)
    return math.degrees(tilt_of(state.qw, state.qx, state.qy, state.qz))


@pytest.fixture
def rig() -> FakeRig:
    rig = FakeRig(ArmSettings())
    rig.advance(0.2)
    return rig

"""The arm agent over a real ROS 1 master: motions, stops, and a robot that does not do its part.

Skipped with the reason where ROS 1 is not installed; asked for by name (`pytest tests/system/test_ros1_arm.py`) it
fails instead.
"""

from __future__ import annotations

import math
import subprocess
import sys
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from shared.bus import Received
from shared.clock import SystemClock
from shared.config import Table
from shared.errors import UserError
from shared.geometry import tilt_of
from shared.memory_bus import MemoryBus
from shared.messages import ArmReply, ArmStop, Heartbeat, Message, MotionReport, PlatformState, TiltCommand
from station.arm import drivers
from station.arm.agent import ArmAgent, arm_agent
from station.arm.drivers import DriverLink, load_driver
from station.arm.drivers._ros1_messages import PUBLISHED_MD5
from station.rig.arm_model import load_arm_model
from station.rig.arm_settings import ArmSettings
from tests.patience import PATIENCE_S
from tests.system.ports import free_port
from tests.system.ros1 import require_ros1, ros_arm, roscore, stop_roscore

DRIVERS = Path(drivers.__file__).parent

pytestmark = pytest.mark.system


@pytest.fixture(scope="module", autouse=True)
def ros1(request: pytest.FixtureRequest) -> Generator[None]:
    require_ros1(request.config)
    yield
    stop_roscore()


@dataclass
class Station:
    """A station's side: heartbeats, commands, and what the arm reports."""

    clock: SystemClock
    bus: MemoryBus
    agent: ArmAgent
    robot: subprocess.Popen[bytes]
    reports: list[MotionReport] = field(default_factory=list)
    platforms: list[PlatformState] = field(default_factory=list)

    def on_report(self, received: Received) -> None:
        assert isinstance(received.message, MotionReport)
        self.reports.append(received.message)

    def on_platform(self, received: Received) -> None:
        assert isinstance(received.message, PlatformState)
        self.platforms.append(received.message)

    def until(self, reached: Callable[[], bool]) -> None:
        deadline = time.monotonic() + PATIENCE_S
        while not reached():
            assert time.monotonic() < deadline, f"not reached; reports: {self.reports}"
            now_ns = self.clock.now_ns()
            self.bus.publish("session/heartbeat", Heartbeat(now_ns, armed=True))
            self.agent.tick(now_ns)
            time.sleep(0.008)

    def ask(self, service: str, message: Message) -> ArmReply:
        replies: list[Message | None] = []
        self.bus.request(service, message, replies.append)
        assert isinstance(replies[0], ArmReply)
        return replies[0]

    def command(self, angle_deg: float, *, rate_deg_s: float = 10.0) -> ArmReply:
        angle, rate = math.radians(angle_deg), math.radians(rate_deg_s)
        return self.ask("arm/command", TiltCommand(self.clock.now_ns(), 1, 1, 0.0, angle, 1, rate))

    def tilt_deg(self) -> float:
        state = self.platforms[-1]
        return math.degrees(tilt_of(state.qw, state.qx, state.qy, state.qz))


@contextmanager
def opened_station(*, mode: str) -> Generator[Station]:
    clock = SystemClock()
    bus = MemoryBus(clock)
    patience_s = 0.3 if mode == "deaf" else PATIENCE_S  # others answer, however busy the machine is
    options = Table({"master_uri": roscore(), "connect_timeout_s": PATIENCE_S, "answer_timeout_s": patience_s})
    with ros_arm("jaco2_spherical", mode=mode) as robot:
        opened = Station(clock, bus, arm_agent(bus, ArmSettings(driver="ros1", armed=True, options=options)), robot)
        bus.subscribe("arm/motion", opened.on_report)
        bus.subscribe("arm/platform", opened.on_platform)
        try:
            opened.until(lambda: len(opened.platforms) > 3 or mode == "foreign")
            yield opened
        finally:
            opened.agent.close()


@pytest.mark.parametrize("mode", ["obey", "gripper"])
def test_a_tilt_is_executed_and_ends_where_it_should(mode: str) -> None:
    with opened_station(mode=mode) as rig:
        assert rig.command(6).accepted
        rig.until(lambda: len(rig.reports) == 2)
        assert rig.reports[1].fault == ""
        # The goal's end and the joints' last place are messages of their own, and may come in either order.
        rig.until(lambda: rig.tilt_deg() == pytest.approx(6, abs=0.05))


def test_a_stop_cancels_the_goal_and_the_arm_stays() -> None:
    with opened_station(mode="obey") as rig:
        rig.command(30)
        rig.until(lambda: bool(rig.platforms) and rig.tilt_deg() > 3)
        rig.ask("arm/stop", ArmStop(rig.clock.now_ns(), "test"))
        halted = rig.clock.now_ns()
        rig.until(lambda: rig.clock.now_ns() > halted + 500_000_000)
        here = rig.tilt_deg()
        rig.until(lambda: rig.clock.now_ns() > halted + 1_500_000_000)
        assert rig.tilt_deg() == pytest.approx(here, abs=1e-6)
        assert here < 25
        assert rig.reports[-1].fault == "emergency stop: test"


@pytest.mark.parametrize(
    ("mode", "said"),
    [
        ("reject", "rejected the motion: the arm is in its cradle"),
        ("abort", "aborted the motion: the arm left the path's tolerance"),
        ("deaf", "did not answer within 0.3 s"),
    ],
)
def test_a_robot_that_does_not_do_its_part_is_named(mode: str, said: str) -> None:
    with opened_station(mode=mode) as rig:
        assert rig.command(4, rate_deg_s=1.0).accepted  # a faster one would be late before its robot is heard
        rig.until(lambda: len(rig.reports) == 2)
        assert said in rig.reports[1].fault


def test_foreign_joint_names_are_named() -> None:
    with opened_station(mode="foreign") as rig:
        until = rig.clock.now_ns() + 500_000_000
        rig.until(lambda: rig.clock.now_ns() > until)
        assert "foreign_0" in rig.command(6).reason


def test_a_robot_that_dies_in_mid_motion_is_noticed() -> None:
    with opened_station(mode="obey") as rig:
        rig.command(40, rate_deg_s=1.0)  # a faster one would be late before its silence is noticed
        rig.until(lambda: bool(rig.platforms) and rig.tilt_deg() > 1)
        rig.robot.kill()
        rig.until(lambda: bool(rig.reports[-1].fault))
        assert "no longer reports its joints" in rig.reports[-1].fault


def test_a_missing_master_and_a_missing_robot_are_told_apart() -> None:
    link = DriverLink(
        bus=MemoryBus(SystemClock()),
        model=load_arm_model("jaco2_spherical"),
        options=Table({"master_uri": f"http://127.0.0.1:{free_port()}"}),
    )
    with pytest.raises(UserError, match="No ROS master answers"):
        load_driver("ros1", link=link)
    alone = DriverLink(
        bus=link.bus, model=link.model, options=Table({"master_uri": roscore(), "connect_timeout_s": 1.0})
    )
    with pytest.raises(UserError, match="nobody serves /j2s6s300/follow_joint_trajectory"):
        load_driver("ros1", link=alone)


def test_the_generated_messages_have_the_published_md5() -> None:
    code = (
        "import sys; sys.path.append('/usr/lib/python3/dist-packages')\n"
        "from _ros1_messages import follow_joint_trajectory as f; print(f().action._md5sum)"
    )
    shown = subprocess.run(["/usr/bin/python3", "-c", code], cwd=DRIVERS, capture_output=True, text=True, check=True)
    assert shown.stdout.strip() == PUBLISHED_MD5["control_msgs/FollowJointTrajectoryAction"]


AGENT = """
import sys, time
import numpy as np
from shared.clock import SystemClock
from shared.config import Table
from shared.memory_bus import MemoryBus
from station.arm.drivers import DriverLink, load_driver
from station.arm.trajectory import JointTrajectory
from station.rig.arm_model import load_arm_model

model = load_arm_model("jaco2_spherical")
link = DriverLink(bus=MemoryBus(SystemClock()), model=model, options=Table({"master_uri": sys.argv[1]}))
driver = load_driver("ros1", link=link)
home = np.array(model.home_rad)
driver.start(
    JointTrajectory(
        times_ns=np.array([0, 60_000_000_000]),
        position_rad=np.array([home, home + 0.6]),
        velocity_rad_s=np.zeros((2, 6)),
    ),
    now_ns=time.time_ns(),
)
time.sleep(3600)
"""


def test_the_goal_of_an_agent_that_was_killed_is_cancelled(tmp_path: Path) -> None:
    script = tmp_path / "agent.py"
    script.write_text(AGENT, encoding="utf-8")
    model = load_arm_model("jaco2_spherical")
    options = Table({"master_uri": roscore(), "connect_timeout_s": PATIENCE_S})
    with ros_arm("jaco2_spherical"):
        looker = load_driver("ros1", link=DriverLink(bus=MemoryBus(SystemClock()), model=model, options=options))

        def angle() -> float:
            looker.tick(time.time_ns())
            reading = looker.read()
            return 0.0 if reading is None else float(reading.position_rad[0]) - model.home_rad[0]

        try:
            with subprocess.Popen([sys.executable, str(script), roscore()]) as agent:
                try:
                    wait_until(lambda: angle() > 0.01)
                finally:
                    agent.kill()
            wait_until(lambda: _rests(angle))
            assert angle() < 0.5
        finally:
            looker.close()


def _rests(angle: Callable[[], float]) -> bool:
    """True if the joint stays where it is while it would turn by 0.005 rad."""
    before = angle()
    time.sleep(0.5)
    return angle() == before


def wait_until(reached: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not reached():
        assert time.monotonic() < deadline
        time.sleep(0.01)

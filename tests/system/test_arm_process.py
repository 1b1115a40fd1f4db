"""`station arm` and `station twin` as real processes on the real bus, with this test as the station.

Signals, the emergency stop, the lost heartbeat and the rates, as they are outside of simulated time.
"""

from __future__ import annotations

import math
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Generator
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from shared.bus import Received
from shared.clock import SystemClock
from shared.geometry import tilt_of
from shared.messages import ArmReply, ArmStop, Heartbeat, Message, MotionReport, PlatformState, TiltCommand
from shared.rig import load_rig
from shared.zenoh_bus import ZenohBus
from tests.patience import PATIENCE_S
from tests.system.ports import free_port
from tests.system.processes import rig_file
from tests.system.ros1 import process

pytestmark = pytest.mark.system


@dataclass
class Station:
    """Heartbeats, commands, and what came back."""

    bus: ZenohBus
    clock: SystemClock
    arm: subprocess.Popen[bytes]
    rig: Path
    reports: list[MotionReport] = field(default_factory=list)
    platforms: list[PlatformState] = field(default_factory=list)
    beats: bool = True
    beat_ns: int = 0

    def receive(self, received: Received) -> None:
        if isinstance(received.message, MotionReport):
            self.reports.append(received.message)
        elif isinstance(received.message, PlatformState):
            self.platforms.append(received.message)

    def until(self, reached: Callable[[], bool]) -> None:
        deadline = time.monotonic() + PATIENCE_S
        while not reached():
            assert time.monotonic() < deadline, f"not reached; reports: {self.reports}"
            now_ns = self.clock.now_ns()
            if self.beats and now_ns - self.beat_ns > 100_000_000:
                self.bus.publish("session/heartbeat", Heartbeat(now_ns, armed=True))
                self.beat_ns = now_ns
            self.bus.poll(0.01)

    def ask(self, service: str, message: Message) -> ArmReply:
        replies: list[Message | None] = []
        self.bus.request(service, message, replies.append, timeout_s=10.0)
        self.until(lambda: bool(replies))
        assert isinstance(replies[0], ArmReply)
        return replies[0]

    def command(self, angle_deg: float, *, rate_deg_s: float = 8.0) -> ArmReply:
        angle, rate = math.radians(angle_deg), math.radians(rate_deg_s)
        return self.ask("arm/command", TiltCommand(self.clock.now_ns(), 3, 1, 0.0, angle, 2, rate))

    def tilt_deg(self) -> float:
        state = self.platforms[-1]
        return math.degrees(tilt_of(state.qw, state.qx, state.qy, state.qz))


@pytest.fixture
def station(tmp_path: Path) -> Generator[Station]:
    ends = {name: f"tcp/127.0.0.1:{free_port()}" for name in ("camera", "arm", "twin", "station")}
    lines = "\n".join(f'{name} = "{end}"' for name, end in ends.items())
    gate = "[arm.gate]\nheartbeat_timeout_s = 0.7\nlevel_after_s = 0.5\nlevel_rate_deg_s = 8.0"
    path = tmp_path / "rig.toml"
    # Tolerances are wide: the machine that runs the tests may be busy, and a late tick is a pose that lags.
    loose = "follow_tolerance_deg = 8.0\nfollow_timeout_s = 3.0\nsilence_timeout_s = 5.0\nsettle_timeout_s = 20.0"
    path.write_text(f'id = "arm-test"\n[bus]\n{lines}\n[arm]\n{gate}\n{loose}\n')
    rig, clock = load_rig(path), SystemClock()
    with ExitStack() as stack:
        for command in ("twin", "arm"):
            arguments = [sys.executable, "-m", "station", command, "--rig", str(path)]
            child = stack.enter_context(process(arguments, {"XDG_STATE_HOME": str(tmp_path)}))
        bus = stack.enter_context(ZenohBus(rig.id, listen=[ends["station"]], connect=rig.bus.peers("station")))
        opened = Station(bus, clock, child, path)  # pyright: ignore[reportPossiblyUnboundVariable] - the loop runs twice
        bus.subscribe("arm/motion", opened.receive)
        bus.subscribe("arm/platform", opened.receive)
        opened.until(lambda: len(opened.platforms) > 20)
        yield opened


def test_a_tilt_runs_from_command_to_rest_and_a_stop_holds_it(station: Station) -> None:
    assert station.command(5).accepted
    station.until(lambda: len(station.reports) == 2)
    begin, end = station.reports
    assert (end.run, end.step, end.fault) == (3, 2, "")
    assert begin.begin_ns == end.begin_ns < end.end_ns
    station.until(lambda: abs(station.tilt_deg() - 5) < 0.02)
    assert station.command(40).accepted
    station.until(lambda: station.tilt_deg() > 6)
    assert station.ask("arm/stop", ArmStop(station.clock.now_ns(), "test")).accepted
    station.until(lambda: len(station.reports) == 4)
    assert station.reports[-1].fault == "emergency stop: test"
    assert "stopped (test)" in station.command(0).reason


def test_a_signal_is_an_emergency_stop_and_another_ends_the_agent(station: Station) -> None:
    assert station.command(40).accepted
    station.until(lambda: station.tilt_deg() > 2)
    station.arm.send_signal(signal.SIGUSR1)
    station.until(lambda: len(station.reports) == 2)
    assert station.reports[-1].fault == "emergency stop: signal"
    assert station.tilt_deg() < 39
    station.arm.send_signal(signal.SIGTERM)
    assert station.arm.wait(timeout=PATIENCE_S) == 0


def test_the_arm_is_stopped_from_another_shell_on_any_system(station: Station) -> None:
    assert station.command(40).accepted
    station.until(lambda: station.tilt_deg() > 2)
    stop = [sys.executable, "-m", "station", "arm", "stop", "--rig", str(station.rig), "--reason", "a hand in the way"]
    with process(stop, {}) as stopping:
        station.until(lambda: len(station.reports) == 2)
        assert stopping.wait(timeout=PATIENCE_S) == 0
    assert station.reports[-1].fault == "emergency stop: a hand in the way"
    assert station.tilt_deg() < 39


def test_without_an_arm_agent_the_stop_says_so(tmp_path: Path) -> None:
    stop = [sys.executable, "-m", "station", "arm", "stop", "--rig", str(rig_file(tmp_path))]
    done = subprocess.run(stop, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "did not answer" in done.stdout


def test_without_the_station_the_arm_levels_by_itself(station: Station) -> None:
    assert station.command(12).accepted
    station.until(lambda: len(station.reports) == 2)
    station.beats = False
    station.until(lambda: len(station.reports) == 4)
    assert station.reports[-1].run == -1
    station.until(lambda: station.tilt_deg() < 0.05)

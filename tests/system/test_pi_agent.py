"""The real process `pi-agent` on a real socket, with a twin that is played here."""

from __future__ import annotations

import contextlib
import math
import os
import signal
import socket
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from shared.bus import Received
from shared.clock import SystemClock
from shared.geometry import block_pose_of
from shared.messages import ClockPing, ClockPong, Message
from shared.zenoh_bus import ZenohBus
from tests.patience import PATIENCE_S
from tests.system.ports import free_port
from tests.unit.pi_agent.rigs import FakeTwin, scene

pytestmark = pytest.mark.system
TOPICS = ("corners", "plate", "image", "image/overlay", "status", "geometry", "calibration")


class Rig:
    """A rig file, the agent as a process, and this test on the bus."""

    def __init__(self, folder: Path) -> None:
        port = free_port()
        self.file = folder / "rig.toml"
        self.file.write_text(
            f'id = "system-{port}"\n[bus]\n'
            f'camera = "tcp/127.0.0.1:{port}"\narm = ""\nstation = ""\n[mark]\nside_mm = 7.5\nmargin = 0.16\n'
        )
        self.clock = SystemClock()
        self.bus = ZenohBus(f"system-{port}", connect=[f"tcp/127.0.0.1:{port}"], clock=self.clock)
        self.heard: dict[str, list[Any]] = defaultdict(list)
        for name in TOPICS:
            self.bus.subscribe(f"camera/{name}", self._keep)
        self.bus.subscribe("log", self._keep)

    def _keep(self, received: Received) -> None:
        self.heard[received.topic].append(received.message)

    def wait(self, happened: Callable[[], bool], agent: subprocess.Popen[bytes]) -> None:
        give_up = time.monotonic() + PATIENCE_S
        while not happened():
            assert agent.poll() is None, "the agent has ended"
            assert time.monotonic() < give_up, f"it did not come to pass: {self.heard['log']}"
            self.bus.poll(0.05)

    @contextlib.contextmanager
    def agent(self, **environment: str) -> Generator[subprocess.Popen[bytes]]:
        command = [sys.executable, "-m", "pi_agent", "--camera", "synthetic", "--rig", str(self.file)]
        process = subprocess.Popen(command, stderr=subprocess.PIPE, env={**os.environ, **environment})
        try:
            yield process
        finally:
            process.kill()
            process.communicate()


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Rig]:
    bench = Rig(tmp_path)
    yield bench
    bench.bus.close()


def test_a_block_that_slides_is_followed_over_the_bus(bench: Rig):
    period = 3.0
    with bench.agent() as agent:
        bench.wait(lambda: any("start `station twin`" in m.fault for m in bench.heard["camera/status"]), agent)
        start_ns = bench.clock.now_ns()
        with FakeTwin(
            bench.bus, bench.clock, lambda t: scene(0.02 * math.sin(2 * math.pi * t / period), 0.005, 0.1)
        ) as twin:
            bench.wait(lambda: len(bench.heard["camera/corners"]) > 150, agent)
            bench.wait(lambda: all(bench.heard[f"camera/{name}"] for name in TOPICS), agent)
            bench.wait(lambda: bench.heard["camera/status"][-1].fault == "", agent)
            replies: list[Message | None] = []
            bench.bus.request("camera/clock", ClockPing(station_ns=1), replies.append)
            bench.wait(lambda: bool(replies), agent)
            del twin
        assert "camera" in bench.bus.alive()
        agent.send_signal(signal.SIGTERM)
        assert agent.wait(timeout=PATIENCE_S) == 0
    assert isinstance(replies[0], ClockPong)
    geometry = bench.heard["camera/geometry"][-1]
    reports = [m for m in bench.heard["camera/corners"] if m.found]
    poses = np.array([block_pose_of(m.corners_px, geometry) for m in reports])
    assert np.ptp(poses[:, 0]) > 0.01
    assert poses[:, 1] == pytest.approx(0.005, abs=5e-5)
    assert poses[:, 2] == pytest.approx(0.1, abs=0.01)
    assert all(m.capture_ns > start_ns for m in reports)
    seqs = [m.seq for m in bench.heard["camera/corners"]]
    assert seqs == sorted(set(seqs))


def test_ctrl_c_ends_the_agent_cleanly(bench: Rig):
    with bench.agent() as agent:
        bench.wait(lambda: bool(bench.heard["camera/status"]), agent)
        agent.send_signal(signal.SIGINT)
        assert agent.wait(timeout=PATIENCE_S) == 0
        assert agent.stderr is not None
        assert b"Traceback" not in agent.stderr.read()


def test_a_second_agent_on_the_same_endpoint_is_refused_in_one_sentence(bench: Rig):
    with bench.agent() as first:
        bench.wait(lambda: bool(bench.heard["camera/status"]), first)
        with bench.agent() as second:
            assert second.wait(timeout=PATIENCE_S) == 2
            assert second.stderr is not None
            assert b"already running" in second.stderr.read()


def test_a_calibration_is_made_by_a_process_and_used_by_the_next(bench: Rig):
    command = [sys.executable, "-m", "pi_agent", "calibrate", "--rig", str(bench.file), "--no-tone", "--frames", "30"]
    with FakeTwin(bench.bus, bench.clock, lambda _: scene(0.004, 0.003, 0.1)):
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
        assert done.returncode == 0, done.stderr
        assert "residuals" in done.stdout
        assert (bench.file.parent / "calibration.png").stat().st_size > 10_000
        bench.file.write_text(bench.file.read_text() + '[camera]\ncalibration = "calibration.toml"\n')
        with bench.agent() as agent:
            bench.wait(lambda: bool(bench.heard["camera/geometry"] and bench.heard["camera/corners"]), agent)
    geometry = bench.heard["camera/geometry"][-1]
    assert geometry.source == "calibration.toml"
    assert geometry.corner_sigma_px > 0
    assert geometry.mm_per_px == pytest.approx(1 / 6.0, rel=1e-3)


def test_a_calibration_without_a_twin_is_refused_in_one_sentence(bench: Rig):
    command = [sys.executable, "-m", "pi_agent", "calibrate", "--rig", str(bench.file), "--no-tone"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    assert done.returncode == 2
    assert done.stderr.strip() == "pi-agent: No scene comes from the twin: start `station twin`"
    assert not (bench.file.parent / "calibration.toml").exists()


def test_systemd_is_told_of_life_only_by_frames(bench: Rig, tmp_path: Path):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(str(tmp_path / "notify"))
        systemd.setblocking(False)
        said: list[str] = []

        def hears(wanted: str) -> bool:
            with contextlib.suppress(BlockingIOError):
                while True:
                    said.append(systemd.recv(500).decode())
            return any(wanted in line for line in said)

        with bench.agent(NOTIFY_SOCKET=str(tmp_path / "notify"), WATCHDOG_USEC="1000000") as agent:
            bench.wait(lambda: hears("READY=1"), agent)
            bench.wait(lambda: hears("start `station twin`"), agent)
            assert not hears("WATCHDOG=1")
            with FakeTwin(bench.bus, bench.clock):
                bench.wait(lambda: hears("WATCHDOG=1"), agent)
            agent.send_signal(signal.SIGTERM)
            bench.wait(lambda: hears("STOPPING=1"), agent)

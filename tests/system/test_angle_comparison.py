"""The comparison on real processes and sockets: twin, arm agent, sensors that speak their real protocols, the command.

The sensors are emulated in this process and tilt with the twin's plate: an autopilot over MAVLink/UDP, a NatNet server,
an inclinometer on a pty. Nothing leaves 127.0.0.1.
"""

from __future__ import annotations

import csv
import math
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from shared.bus import Received
from shared.foxglove import Log
from shared.messages import AngleReading, TwinScene
from shared.rig import RigConfig, load_rig
from shared.zenoh_bus import ZenohBus
from station.recording.reader import open_recording
from tests.patience import PATIENCE_S
from tests.system.ports import free_port
from tests.unit.angles.emulators import Motive, Options, Pixhawk, SerialInclinometer

pytestmark = pytest.mark.system

SHORT = ["--step-deg", "5", "--sweeps", "1", "--rate-deg-s", "10", "--settle-s", "0.2", "--readings", "25"]
SHORTER = ["--step-deg", "10", "--readings", "5"]
STOPS = 5
PROCEDURE = """
id = "{rig}"
[bus]
camera = ""
arm = "tcp/127.0.0.1:{arm}"
twin = "tcp/127.0.0.1:{twin}"
station = "tcp/127.0.0.1:{station}"
[arm]
driver = "simulated"
[arm.gate]
level_after_s = 0.5
level_rate_deg_s = 20.0
[twin]
pair = "steel_on_steel"
"""
INTERNAL = """
[angles.internal]
kind = "kinematics"
mount_rpy_deg = [-0.16, 0.0, 0.0]
"""


def toml(name: str, kind: str, options: Options) -> str:
    lines = [
        f"{key} = {str(value).lower() if isinstance(value, bool) else repr(value)}" for key, value in options.items()
    ]
    return "\n".join([f"[angles.{name}]", f'kind = "{kind}"', *lines]) + "\n"


class Process:
    """A command of the station; what it says is kept line by line."""

    def __init__(self, *words: str, typed: str = "") -> None:
        self.child = subprocess.Popen(
            [sys.executable, "-m", "station", *words],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            stdin=subprocess.PIPE if typed else subprocess.DEVNULL,
            text=True,
        )
        if self.child.stdin is not None:
            self.child.stdin.write(typed)
            self.child.stdin.close()
        self.lines: list[str] = []
        self._fresh: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.child.stdout is not None
        for line in self.child.stdout:
            self.lines.append(line.rstrip())
            self._fresh.put(line.rstrip())
        self._fresh.put(None)

    @property
    def text(self) -> str:
        return "\n".join(self.lines)

    def await_line(self, part: str) -> None:
        deadline = time.monotonic() + PATIENCE_S
        while (left := deadline - time.monotonic()) > 0:
            try:
                line = self._fresh.get(timeout=left)
            except queue.Empty:
                break
            if line is None or part in line:
                assert line is not None, f"ended without saying {part!r}:\n{self.text}"
                return
        raise AssertionError(f"never said {part!r}:\n{self.text}")

    def end(self, *, by: int | None = None) -> int:
        """Waits for the end, after a signal if one is given; the exit status."""
        if by is not None and self.child.poll() is None:
            self.child.send_signal(by)
        try:
            status = self.child.wait(timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.child.kill()
            self.child.wait()
            raise AssertionError(f"did not end:\n{self.text}") from None
        self._reader.join(timeout=PATIENCE_S)
        assert self.child.stdout is not None
        self.child.stdout.close()
        return status


@contextmanager
def running(*words: str, until: str) -> Generator[Process]:
    process = Process(*words)
    try:
        process.await_line(until)
        yield process
    finally:
        process.end(by=signal.SIGTERM)


class Rig:
    """Twin and arm agent on free ports, shared by the tests of this file."""

    def __init__(self, folder: Path) -> None:
        self._head = PROCEDURE.format(rig=folder.name, arm=free_port(), twin=free_port(), station=free_port())
        self.base = self.file(folder, INTERNAL)

    def file(self, folder: Path, angles: str) -> Path:
        path = folder / "rig.toml"
        path.write_text(self._head + angles, encoding="utf-8")
        return path


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    rig = Rig(tmp_path_factory.mktemp("angle-rig"))
    with (
        running("twin", "--rig", str(rig.base), until="is on the bus"),
        running("arm", "--rig", str(rig.base), until="is on the bus"),
    ):
        yield rig


class Plate:
    """The emulated sensors on the twin's plate; each can be told to stop or to babble."""

    def __init__(self, config: RigConfig) -> None:
        self.pixhawk, self.motive, self.inclinometer = Pixhawk(), Motive(), SerialInclinometer()
        self.on_tilt: Callable[[float], None] = lambda _tilt: None
        self.motive_is_on = True
        self._rng = np.random.default_rng(5)
        self._count = 0
        self._stop = threading.Event()
        self._bus = ZenohBus(config.id, listen=(), connect=config.bus.endpoint("twin"))
        self._bus.subscribe("truth/scene", self._tilt)
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def tables(self) -> str:
        return (
            toml("imu", "mavlink", self.pixhawk.options())
            + toml("mocap", "natnet", self.motive.options())
            + toml("inclinometer", "inclinometer", self.inclinometer.options())
        )

    def _run(self) -> None:
        while not self._stop.is_set():
            self._bus.poll(0.01)
            self.pixhawk.serve()
            if self.motive_is_on:
                self.motive.serve()

    def _tilt(self, received: Received) -> None:
        """200 times a second; the sensors speak at 100, 100 and 33 Hz."""
        scene = received.message
        assert isinstance(scene, TwinScene)
        tilt = math.remainder(2 * math.atan2(scene.qx, scene.qw), 2 * math.pi)  # the direction 0 turns about x
        self.on_tilt(tilt)
        self._count += 1
        if self._count % 2 == 0:
            self.pixhawk.say(tilt + math.radians(0.4) * self._rng.standard_normal())
            if self.motive_is_on:
                self.motive.say(tilt + math.radians(0.5))
        if self._count % 100 == 0:
            self.pixhawk.heartbeat()
        if self._count % 6 == 0:
            self.inclinometer.say(tilt + math.radians(0.02) * self._rng.standard_normal())

    def close(self) -> None:
        self._stop.set()
        self._thread.join()
        self._bus.close()
        for sensor in (self.pixhawk, self.motive, self.inclinometer):
            sensor.close()


@pytest.fixture
def plate(rig: Rig) -> Iterator[Plate]:
    plate = Plate(load_rig(rig.base))
    yield plate
    plate.close()


def rows(path: Path, *keys: str) -> dict[frozenset[str], dict[str, str]]:
    found = csv.DictReader(path.read_text(encoding="utf-8").splitlines())
    return {frozenset(row[key] for key in keys): row for row in found}


Compare = Callable[..., Process]


@pytest.fixture
def compare(tmp_path: Path) -> Iterator[Compare]:
    """Starts the command for a rig file; whatever is left of it at the test's end is stopped."""
    started: list[Process] = []

    def start(rig_file: Path, *more: str, typed: str = "") -> Process:
        out = ("--out", str(tmp_path / "angles.mcap"))
        tables = ("--table", str(tmp_path / "pairs.csv"), "--fits", str(tmp_path / "fits.csv"))
        process = Process("compare-angles", "--rig", str(rig_file), *out, *tables, *SHORT, *more, typed=typed)
        started.append(process)
        return process

    yield start
    for process in started:
        if process.child.poll() is None:
            process.end(by=signal.SIGTERM)


def test_the_papers_biases_are_found_over_the_real_protocols(
    rig: Rig, plate: Plate, compare: Compare, tmp_path: Path
) -> None:
    figure = tmp_path / "fig3.png"
    file = rig.file(tmp_path, INTERNAL + plate.tables() + '[angles.gauge]\nkind = "typed"\n')
    process = compare(file, "--figure", str(figure), typed="0.1\n5.1\noops\n10.1\n5,1\n0.1\n")
    assert process.end() == 0, process.text
    pairs = rows(tmp_path / "pairs.csv", "first", "second")

    def cell(first: str, second: str) -> tuple[float, float]:
        row = pairs[frozenset((first, second))]
        assert int(row["instants"]) == STOPS * 25
        return float(row["mean_abs_deg"]), float(row["sd_deg"])

    assert cell("commanded", "internal")[0] == pytest.approx(0.16, abs=0.02)
    assert cell("commanded", "mocap")[0] == pytest.approx(0.50, abs=0.02)
    assert cell("internal", "mocap")[0] == pytest.approx(0.34, abs=0.02)
    assert cell("commanded", "imu")[1] == pytest.approx(0.40, abs=0.12)
    assert cell("commanded", "inclinometer")[0] < 0.05
    assert cell("commanded", "gauge")[0] == pytest.approx(0.10, abs=0.02)
    assert figure.read_bytes().startswith(b"\x89PNG")
    assert f"({STOPS} stops)" in process.text
    recorded = open_recording(tmp_path / "angles.mcap").topics
    for topic in ("angle/imu", "angle/mocap", "angle/inclinometer", "angle/internal"):
        assert recorded[topic].count >= STOPS * 25
    for topic in ("arm/command", "arm/motion", "session/event", "arm/platform"):
        assert recorded[topic].count > 0


def test_a_sensor_that_dies_and_one_that_babbles_are_told_and_the_others_go_on(
    rig: Rig, plate: Plate, compare: Compare, tmp_path: Path
) -> None:
    babbled: list[float] = []

    def harm(tilt: float) -> None:
        if tilt > math.radians(4.5) and plate.motive_is_on:
            plate.motive_is_on = False
            babbled.append(tilt)
            plate.inclinometer.babble()

    process = compare(rig.file(tmp_path, INTERNAL + plate.tables()), *SHORTER, "--patience-s", "2")
    process.await_line("stop 1: 0.00 degrees")
    plate.on_tilt = harm
    assert process.end() == 0, process.text
    assert babbled
    for sentence in (
        "The angle source mocap has said nothing for 2.0 s: check its power and its cable.",
        "The angle source inclinometer gave no reading",
        "Nothing from mocap at sweep 1, stop 2.",
        "mocap: readings at",
    ):
        assert sentence in process.text, process.text
    fits = rows(tmp_path / "fits.csv", "source")
    stops = {name: int(fits[frozenset((name,))]["stops"]) for name in ("imu", "inclinometer", "mocap")}
    assert stops == {"imu": 3, "inclinometer": 3, "mocap": 1}
    logged = [
        item.message.message
        for item in open_recording(tmp_path / "angles.mcap").messages(["log"])
        if isinstance(item.message, Log)
    ]
    assert any("mocap has said nothing" in line for line in logged)
    assert any("inclinometer gave no reading" in line for line in logged)


def test_sources_that_run_already_are_not_read_twice(rig: Rig, compare: Compare, tmp_path: Path) -> None:
    file = rig.file(tmp_path, INTERNAL + '[angles.twin]\nkind = "simulated"\n')
    with running("angles", "--rig", str(file), until="are read: internal, twin"):
        process = compare(file, *SHORTER)
        assert process.end() == 0, process.text
    recording = open_recording(tmp_path / "angles.mcap")
    assert recording.topics["angle/twin"].count > 3 * 5
    stamps: list[int] = []
    for item in recording.messages(["angle/internal"]):
        assert isinstance(item.message, AngleReading)
        stamps.append(item.message.stamp_ns)
    # One reading for each state of the arm; two readers would have given two.
    assert len(stamps) <= 1.2 * recording.topics["arm/platform"].count
    pairs = rows(tmp_path / "pairs.csv", "first", "second")
    assert float(pairs[frozenset(("twin", "internal"))]["mean_abs_deg"]) == pytest.approx(0.16, abs=0.02)


def test_without_an_arm_agent_it_says_what_to_start(compare: Compare, tmp_path: Path) -> None:
    lonely = Rig(tmp_path)
    process = compare(lonely.base)
    assert process.end() == 2
    assert "start station arm" in process.text
    assert "Traceback" not in process.text


def test_ctrl_c_ends_it_with_what_was_read_so_far(rig: Rig, compare: Compare, tmp_path: Path) -> None:
    process = compare(rig.base)
    process.await_line("stop 2: 5.00 degrees")
    assert process.end(by=signal.SIGINT) == 1
    assert "stopped by the user" in process.text
    assert "(2 stops)" in process.text or "(3 stops)" in process.text
    assert open_recording(tmp_path / "angles.mcap").topics["session/event"].count >= 4

"""Every angle source keeps its promises: every file in station/angles/sources, through its real protocol."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from shared.bus import Received
from shared.clock import SystemClock
from shared.config import Table
from shared.errors import UserError
from shared.memory_bus import MemoryBus
from shared.messages import AngleReading
from station.angles.instruments import Instruments
from station.angles.reading import Reading, inclination, message_of_reading
from station.angles.sources import AngleSource, SourceLink, load_kind, source_kinds
from tests.patience import PATIENCE_S
from tests.unit.angles.emulators import (
    ArmOnBus,
    Emulator,
    GaugeReader,
    Motive,
    Pixhawk,
    SerialInclinometer,
    TwinOnBus,
    serving,
)

TILTS = tuple(math.radians(angle) for angle in (0.0, 3.0, 10.0, 0.5))
BABBLING = {"mavlink", "natnet", "inclinometer"}
"""The kinds whose wire can carry nonsense."""


class Bench:
    """One source at its emulator."""

    def __init__(self, kind: str, folder: Path) -> None:
        self.clock = SystemClock()
        self.bus = MemoryBus(self.clock)
        self.complaints: list[str] = []
        self.end = self._end(kind, folder)
        self.link = SourceLink(
            name="sensor",
            bus=self.bus,
            clock=self.clock,
            options=Table(dict(self.end.options())),
            complain=self.complaints.append,
        )
        self.source: AngleSource = load_kind(kind).connect(self.link)

    def _end(self, kind: str, folder: Path) -> Emulator:
        if kind == "kinematics":
            return ArmOnBus(self.bus)
        if kind == "simulated":
            return TwinOnBus(self.bus)
        if kind == "typed":
            return GaugeReader(self.bus, folder=folder, angles_rad=TILTS)
        ends = {"mavlink": Pixhawk, "natnet": Motive, "inclinometer": SerialInclinometer}
        assert kind in ends, f"the source {kind} has no emulator in tests/unit/angles/emulators.py: write one"
        return ends[kind]()

    def open(self) -> None:
        with serving(self.end):
            self.source.open()
        if isinstance(self.end, SerialInclinometer):
            self.end.cable.write(b"3.21\r\n")  # the end of "-13.21", which was under way: no reading

    def hear(self, angle_rad: float, *, azimuth_rad: float = 0.0) -> Reading:
        """Says one tilt and waits for its reading."""
        self.end.say(angle_rad, azimuth_rad=azimuth_rad)
        return self.wait()[-1]

    def wait(self, timeout_s: float = 10.0) -> tuple[Reading, ...]:
        deadline = time.monotonic() + timeout_s
        while time.monotonic() < deadline:
            if readings := self.source.read():
                return readings
            time.sleep(0.001)
        raise AssertionError(f"no reading; complaints: {self.complaints}")


@pytest.fixture(params=source_kinds())
def kind(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def bench(kind: str, tmp_path: Path) -> Iterator[Bench]:
    bench = Bench(kind, tmp_path)
    bench.open()
    yield bench
    bench.source.close()
    bench.end.close()


def test_the_five_kinds_of_the_paper_and_the_twins_are_here() -> None:
    assert set(source_kinds()) >= {"kinematics", "mavlink", "natnet", "inclinometer", "typed", "simulated"}


def test_it_reads_the_tilt_that_is_there(bench: Bench) -> None:
    for tilt in TILTS:
        reading = bench.hear(tilt)
        assert abs(reading.angle_rad) == pytest.approx(tilt, abs=bench.end.tolerance_rad)
        message = message_of_reading(reading, source="sensor")
        assert inclination(message, azimuth_rad=0.0) == pytest.approx(tilt, abs=bench.end.tolerance_rad)


def test_it_knows_where_down_is(bench: Bench) -> None:
    if bench.end.axes != 3:
        assert bench.hear(TILTS[1]).gravity is None
        return
    for direction in range(4):
        azimuth = direction * math.pi / 2
        message = message_of_reading(bench.hear(math.radians(8.0), azimuth_rad=azimuth), source="sensor")
        for asked in range(4):
            expected = math.radians(8.0) * math.cos(asked * math.pi / 2 - azimuth)
            found = inclination(message, azimuth_rad=asked * math.pi / 2)
            assert found == pytest.approx(expected, abs=1e-6)


def test_stamps_are_the_stations_and_in_order(bench: Bench) -> None:
    before = bench.clock.now_ns()
    stamps: list[int] = []
    for tilt in TILTS[:3]:
        stamps.append(bench.hear(tilt).stamp_ns)
    assert before - 20_000_000 <= stamps[0]  # a stamp that a sensor's own clock puts apart may reach back a little
    assert stamps == sorted(stamps)
    assert stamps[-1] <= bench.clock.now_ns()


def test_nothing_new_is_nothing(bench: Bench) -> None:
    bench.hear(TILTS[1])
    assert bench.source.read() == ()


def test_it_can_be_closed_twice_read_while_closed_and_opened_again(bench: Bench) -> None:
    bench.hear(TILTS[0])
    bench.source.close()
    bench.source.close()
    assert bench.source.read() == ()
    bench.open()
    expected = TILTS[1] if isinstance(bench.end, GaugeReader) else TILTS[2]  # the list goes on where it was
    assert bench.hear(TILTS[2]).angle_rad == pytest.approx(expected, abs=bench.end.tolerance_rad)


def test_a_wrong_option_is_named(kind: str, tmp_path: Path) -> None:
    bench = Bench(kind, tmp_path)
    with pytest.raises(UserError, match="colour"):
        load_kind(kind).connect(SourceLink(name="s", bus=bench.bus, clock=bench.clock, options=Table({"colour": 1})))
    bench.end.close()


def test_nonsense_is_told_and_the_next_reading_comes(kind: str, bench: Bench) -> None:
    if kind not in BABBLING:
        return
    bench.hear(TILTS[1])
    bench.end.babble()
    reading = bench.hear(TILTS[2])
    assert reading.angle_rad == pytest.approx(TILTS[2], abs=bench.end.tolerance_rad)
    assert bench.complaints, "nonsense went unnoticed"


def test_it_is_published_by_its_name_in_the_rig_file(kind: str, tmp_path: Path) -> None:
    bench = Bench(kind, tmp_path)
    heard: list[AngleReading] = []

    def take(received: Received) -> None:
        assert isinstance(received.message, AngleReading)
        heard.append(received.message)

    bench.bus.subscribe("angle/probe", take)
    table = Table({"probe": {"kind": kind, "sigma_deg": 0.25, **bench.end.options()}})
    with serving(bench.end):
        instruments = Instruments(bench.bus, table, clock=bench.clock)
        deadline = time.monotonic() + PATIENCE_S
        while not heard and time.monotonic() < deadline:
            bench.end.say(TILTS[0])
            instruments.tick()
            time.sleep(0.01)
        instruments.close()
    bench.end.close()
    assert heard
    assert heard[0].source == "probe"
    assert heard[0].sigma_rad == pytest.approx(math.radians(0.25))
    assert heard[0].stamp_ns > 0

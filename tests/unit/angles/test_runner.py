"""One bad sensor: its fault is said in a sentence, it is tried again, and the others go on."""

from __future__ import annotations

import math
import queue
from collections.abc import Callable

import pytest

from shared.bus import Received
from shared.clock import SimulatedClock
from shared.config import Table
from shared.errors import UserError
from shared.foxglove import Log
from shared.memory_bus import MemoryBus
from shared.messages import AngleReading, PlatformState
from station.angles.instruments import Instruments, source_names
from station.angles.reading import Reading
from station.angles.runner import Runner
from station.angles.settings import SourceSettings
from station.angles.sources import load_kind


class Scripted:
    """A source that does what the test says."""

    def __init__(self, clock: SimulatedClock) -> None:
        self._clock = clock
        self.opened = self.closed = 0
        self.on_open: Callable[[], None] = lambda: None
        self.on_read: Callable[[], tuple[Reading, ...]] = lambda: (Reading(stamp_ns=clock.now_ns(), angle_rad=0.1),)

    def open(self) -> None:
        self.opened += 1
        self.on_open()

    def read(self) -> tuple[Reading, ...]:
        return self.on_read()

    def close(self) -> None:
        self.closed += 1


class Bench:
    def __init__(self) -> None:
        self.clock = SimulatedClock()
        self.source = Scripted(self.clock)
        self.complaints: queue.SimpleQueue[str] = queue.SimpleQueue()
        self.runner = Runner(
            "probe",
            self.source,
            settings=SourceSettings(retry_s=1.0, sigma_deg=0.5),
            silent_s=2.0,
            clock=self.clock,
            complaints=self.complaints,
        )
        self.said: list[str] = []

    def step(self, seconds: float = 0.1) -> tuple[Reading, ...]:
        self.clock.advance_to(self.clock.now_ns() + round(seconds * 1e9))
        batch = self.runner.step()
        self.said += [note.text for note in batch.notes]
        return batch.readings


def failing(error: Exception) -> Callable[[], tuple[Reading, ...]]:
    def fail() -> tuple[Reading, ...]:
        raise error

    return fail


def test_readings_carry_the_makers_sigma() -> None:
    assert Bench().step()[0].sigma_rad == pytest.approx(math.radians(0.5))


def test_a_fault_is_said_once_retried_and_its_end_is_said() -> None:
    bench = Bench()
    well = bench.source.on_read
    bench.source.on_read = failing(OSError("device reports readiness to read but returned no data"))
    for _ in range(50):
        assert bench.step() == ()
    assert len(bench.said) == 1
    assert "probe failed" in bench.said[0]
    assert "returned no data" in bench.said[0]
    assert 4 <= bench.source.opened <= 6  # once a second in five seconds
    assert bench.source.closed >= bench.source.opened - 1
    bench.source.on_read = well
    assert any(bench.step() for _ in range(15))
    assert bench.said[1:] == ["The angle source probe works again."]


def test_one_that_cannot_be_opened_is_said_with_its_own_sentence() -> None:
    bench = Bench()
    error = UserError("Expected a serial port at /dev/nowhere")

    def refuse() -> None:
        raise error

    bench.source.on_open = refuse
    for _ in range(40):
        bench.step()
    assert len(bench.said) == 1
    assert "Expected a serial port at /dev/nowhere" in bench.said[0]
    assert "UserError" not in bench.said[0]


def test_a_silent_source_is_opened_anew() -> None:
    bench = Bench()
    bench.step()
    well = bench.source.on_read
    bench.source.on_read = lambda: ()
    for _ in range(59):
        bench.step()
    assert len(bench.said) == 1
    assert "has said nothing for 2.0 s" in bench.said[0]
    assert bench.source.opened > 1
    bench.source.on_read = well
    while len(bench.said) < 2:
        bench.step()
    assert float(bench.said[1].split()[-2]) >= 6.0  # since it last spoke, not since it was opened anew


def test_readings_that_are_not_numbers_are_left_out_and_said() -> None:
    bench = Bench()
    good = Reading(stamp_ns=1, angle_rad=0.1)
    bench.source.on_read = lambda: (Reading(stamp_ns=1, angle_rad=math.nan), good)
    assert [reading.angle_rad for reading in bench.step()] == [0.1]
    bench.step()
    assert "1 readings are not numbers" in bench.said[0]


def test_closing_a_source_that_cannot_be_closed_is_survived() -> None:
    bench = Bench()
    bench.step()
    bench.source.close = failing(RuntimeError("stuck"))  # type: ignore[method-assign]  # the fault to be survived
    bench.runner.close()


# --- all sources together -------------------------------------------------------------------------------------------


def test_a_dead_sensor_stops_no_other() -> None:
    clock = SimulatedClock()
    bus = MemoryBus(clock)
    heard: list[str] = []
    lines: list[str] = []

    def take(received: Received) -> None:
        if isinstance(received.message, AngleReading):
            heard.append(received.topic)
        elif isinstance(received.message, Log):
            lines.append(received.message.message)

    bus.subscribe("**", take)
    table = Table({"dead": {"kind": "inclinometer", "port": "/dev/no-such-port"}, "kinematics": {}})
    instruments = Instruments(bus, table, clock=clock, threaded=False)
    for _ in range(10):
        bus.publish("arm/platform", PlatformState())
        instruments.tick()
        clock.advance_to(clock.now_ns() + 10_000_000)
    instruments.close()
    assert heard == ["angle/kinematics"] * 10
    assert len(lines) == 1
    assert "/dev/no-such-port" in lines[0]


def test_threads_read_too_and_end() -> None:
    clock = SimulatedClock()
    bus = MemoryBus(clock)
    instruments = Instruments(bus, Table({"a": {"kind": "kinematics"}, "b": {"kind": "kinematics"}}), clock=clock)
    heard: list[str] = []
    for name in ("a", "b"):
        bus.subscribe(f"angle/{name}", lambda received: heard.append(received.topic))
    bus.publish("arm/platform", PlatformState())
    for _ in range(1000):
        instruments.tick()
        if len(heard) == 2:
            break
        instruments._stop.wait(0.005)  # pyright: ignore[reportPrivateUsage]  # lets the threads run
    instruments.close()
    assert sorted(heard) == ["angle/a", "angle/b"]


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({}, "at least one angle source"),
        ({"x": {"kind": "telepathy"}}, "telepathy"),
        ({"x": {"kind": "mavlink", "silent_s": "long"}}, "silent_s"),
        ({"a/b": {"kind": "kinematics"}}, "a/b"),
        ({"x": {"kind": "inclinometer"}}, "port"),
        ({"x": {"kind": "inclinometer", "port": "p", "pattern": "("}}, "regular expression"),
        ({"x": {"kind": "inclinometer", "port": "p", "pattern": "(.*)"}}, "group"),
        ({"x": {"kind": "mavlink", "system_id": 300}}, "system_id"),
        ({"x": {"kind": "simulated", "axes": 2}}, "axes"),
        ({"x": {"kind": "kinematics", "jump_deg": -1.0}}, "jump_deg"),
        ({"x": {"kind": "typed", "file": "no-such-file.txt"}}, "no-such-file.txt"),
    ],
)
def test_mistakes_in_the_rig_file_are_named(table: dict[str, object], said: str) -> None:
    clock = SimulatedClock()
    with pytest.raises(UserError, match=said):
        Instruments(MemoryBus(clock), Table(table), clock=clock, threaded=False)


@pytest.mark.parametrize("name", ["", "a/b", "a.b", '"a', "<b>a</b>", "a\nb", "=a", "a\x1b[2J"])
def test_a_source_has_the_alphabet_of_a_rigs_id(name: str) -> None:
    """Quotes, markup and control characters were taken, into keys on the bus, pages and tables."""
    clock = SimulatedClock()
    with pytest.raises(UserError, match="expected a name of letters, digits, '-' and '_' in") as told:
        Instruments(MemoryBus(clock), Table({name: {"kind": "simulated"}}), clock=clock, threaded=False)
    assert str(told.value).isprintable()


def test_names_and_kinds_of_a_rig() -> None:
    names = source_names(Table({"gauge": {"kind": "typed"}, "natnet": {}}))
    assert [(one.name, one.kind, one.on_demand) for one in names] == [
        ("gauge", "typed", True),
        ("natnet", "natnet", False),
    ]


def test_an_unknown_kind_lists_the_known_ones() -> None:
    with pytest.raises(UserError, match="inclinometer, kinematics, mavlink, natnet"):
        load_kind("crystal")

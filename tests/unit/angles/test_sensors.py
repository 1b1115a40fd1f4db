"""Each sensor has particulars, tested through its real protocol on loopback."""

from __future__ import annotations

import io
import math
import queue
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from shared.clock import SystemClock
from shared.config import Table
from shared.errors import UserError
from shared.memory_bus import MemoryBus
from shared.messages import RunEvent
from station.angles.reading import Reading
from station.angles.sources import AngleSource, SourceLink, load_kind
from station.angles.sources.inclinometer import nmea_checksum
from station.angles.sources.typed import Person, TypedOptions
from tests.patience import PATIENCE_S
from tests.pseudo_terminal import Pty
from tests.unit.angles.emulators import Motive, Options, Pixhawk, SerialInclinometer, free_udp_port, serving


class Bench:
    def __init__(self, kind: str, options: Options) -> None:
        self.clock = SystemClock()
        self.bus = MemoryBus(self.clock)
        self.complaints: list[str] = []
        link = SourceLink(
            name="s", bus=self.bus, clock=self.clock, options=Table(dict(options)), complain=self.complaints.append
        )
        self.source: AngleSource = load_kind(kind).connect(link)

    def wait(self, count: int = 1) -> list[Reading]:
        readings: list[Reading] = []
        deadline = time.monotonic() + PATIENCE_S
        while len(readings) < count and time.monotonic() < deadline:
            readings += self.source.read()
            time.sleep(0.001)
        assert len(readings) >= count, self.complaints
        return readings


# --- MAVLink --------------------------------------------------------------------------------------------------------


def test_an_autopilot_on_a_serial_port_streams_when_it_is_asked() -> None:
    pixhawk = Pixhawk(serial=True, shy=True)
    bench = Bench("mavlink", {**pixhawk.options(), "rate_hz": 100.0})
    bench.source.open()
    deadline = time.monotonic() + PATIENCE_S
    readings: tuple[Reading, ...] = ()
    while not readings and time.monotonic() < deadline:
        pixhawk.heartbeat()
        pixhawk.serve()
        pixhawk.say(math.radians(4.0))
        time.sleep(0.01)
        readings = bench.source.read()
    bench.source.close()
    pixhawk.close()
    assert [one.angle_rad for one in readings] == [pytest.approx(math.radians(4.0), abs=1e-6)] * len(readings)
    assert readings
    assert pixhawk.asked_hz[0] == pytest.approx(100.0)
    assert pixhawk.ground_stations >= 1


def test_attitudes_of_one_batch_are_put_apart_by_the_autopilots_clock() -> None:
    pixhawk = Pixhawk()
    bench = Bench("mavlink", pixhawk.options())
    bench.source.open()
    for _ in range(3):
        pixhawk.say(0.1)
        time.sleep(0.05)
    stamps = [reading.stamp_ns for reading in bench.wait(3)]
    bench.source.close()
    pixhawk.close()
    assert (stamps[1] - stamps[0]) * 1e-9 > 0.03
    assert stamps == sorted(stamps)


def test_nothing_of_a_burst_is_lost() -> None:
    pixhawk = Pixhawk()
    bench = Bench("mavlink", pixhawk.options())
    bench.source.open()
    tilts = np.linspace(0.0, 0.2, 200)
    for tilt in tilts.tolist():
        pixhawk.say(tilt)
    readings = bench.wait(200)
    bench.source.close()
    pixhawk.close()
    assert [reading.angle_rad for reading in readings] == pytest.approx(tilts.tolist(), abs=1e-6)


def test_another_autopilot_on_the_link_is_left_out() -> None:
    pixhawk = Pixhawk()
    bench = Bench("mavlink", {**pixhawk.options(), "system_id": 2})
    bench.source.open()
    pixhawk.say(0.1)
    time.sleep(0.05)
    assert bench.source.read() == ()
    bench.source.close()
    pixhawk.close()


def test_two_listeners_on_one_port_are_told() -> None:
    port = free_udp_port()
    first, second = (Bench("mavlink", {"port": f"udp:127.0.0.1:{port}"}) for _ in range(2))
    first.source.open()
    with pytest.raises(UserError, match="is another program listening"):
        second.source.open()
    first.source.close()


@pytest.mark.parametrize(("port", "said"), [("udp:14550", "udp:HOST:PORT"), ("/dev/no-such-port", "no-such-port")])
def test_a_port_that_is_none_is_told(port: str, said: str) -> None:
    with pytest.raises(UserError, match=said):
        Bench("mavlink", {"port": port}).source.open()


# --- NatNet ---------------------------------------------------------------------------------------------------------


@pytest.fixture
def motive() -> Iterator[Motive]:
    server = Motive(up_axis="z")
    yield server
    server.close()


def test_motive_with_z_up(motive: Motive) -> None:
    bench = Bench("natnet", motive.options())
    with serving(motive):
        bench.source.open()
    motive.say(math.radians(6.0), azimuth_rad=math.pi / 2)
    reading = bench.wait()[0]
    bench.source.close()
    assert reading.gravity is not None
    assert reading.gravity[0] == pytest.approx(math.sin(math.radians(6.0)), abs=1e-6)  # direction 1: downhill is +x


def test_a_hidden_or_absent_body_is_told_and_gives_no_reading(motive: Motive) -> None:
    for extra, seen, said in (({}, False, "markers covered"), ({"rigid_body": 3}, True, "streams 7")):
        bench = Bench("natnet", {**motive.options(), **extra})
        with serving(motive):
            bench.source.open()
        motive.say(0.1, seen=seen)
        deadline = time.monotonic() + PATIENCE_S
        while not bench.complaints and time.monotonic() < deadline:
            assert bench.source.read() == ()
            time.sleep(0.001)
        bench.source.close()
        assert said in bench.complaints[0]


def test_no_motive_is_told() -> None:
    server = Motive(mute=True)
    bench = Bench("natnet", {**server.options(), "timeout_s": 0.2})
    with pytest.raises(UserError, match="switch streaming on"):
        bench.source.open()
    server.close()


# --- inclinometer ---------------------------------------------------------------------------------------------------


def lines_read(text: bytes, **options: object) -> tuple[list[float], list[str]]:
    """Degrees and complaints for what arrives on a cable after one whole line."""
    cable = Pty()
    bench = Bench("inclinometer", {"port": cable.name, **options})
    bench.source.open()
    cable.write(b"half a line\r\n" + text)
    readings: list[Reading] = []
    deadline = time.monotonic() + (0.3 if not text else 0.1)
    while time.monotonic() < deadline:
        readings += bench.source.read()
        time.sleep(0.002)
    bench.source.close()
    cable.close()
    return [round(math.degrees(reading.angle_rad), 6) for reading in readings], bench.complaints


@pytest.mark.parametrize(
    ("line", "degrees"),
    [
        (b"+012.34\r\n", 12.34),
        (b"-0.5\n", -0.5),
        (b"X=1.25 deg\r\n", 1.25),
        (b"X: 2.5\xb0\r\n", 2.5),
        (b"X: 2.5\xc2\xb0\r\n", 2.5),
        (b"$INC,-0.50\r\n", -0.5),
        (b"359.90\r\n", -0.1),
    ],
)
def test_the_usual_lines_are_understood(line: bytes, degrees: float) -> None:
    assert lines_read(line) == ([degrees], [])


@pytest.mark.parametrize(
    "line", [b"ERR 12\r\n", b"12.3 45.6\r\n", b"\x80\x81\r\n", b"+999.9\r\n", b"1.2.3\r\n", b"nan\n"]
)
def test_other_lines_are_no_readings(line: bytes) -> None:
    readings, complaints = lines_read(line + b"1.5\r\n")
    assert readings == [1.5]
    assert len(complaints) == 1


def test_a_checksum_that_does_not_fit_is_no_reading() -> None:
    good = f"$INC,2.50*{nmea_checksum('INC,2.50'):02X}\r\n".encode()
    bad = good.replace(b"2.50", b"7.50")
    readings, complaints = lines_read(good + bad + b"2.50\r\n", checksum="nmea")
    assert readings == [2.5]
    assert len(complaints) == 2


def test_units_sign_and_offset() -> None:
    assert lines_read(b"17.45506\n", unit="mm/m")[0] == [pytest.approx(1.0, abs=1e-5)]
    assert lines_read(b"0.1\n", unit="rad")[0] == [pytest.approx(math.degrees(0.1), abs=1e-5)]
    assert lines_read(b"1.5\n", sign=-1, offset_deg=0.25)[0] == [pytest.approx(-1.75)]


def test_two_axes_give_the_direction_of_gravity() -> None:
    cable = Pty()
    pattern = r"(?P<x>[-+.\d]+);(?P<y>[-+.\d]+)"
    bench = Bench("inclinometer", {"port": cable.name, "pattern": pattern})
    bench.source.open()
    cable.write(b"\n3.0;-4.0\n80;80\n")
    reading = bench.wait()[0]
    bench.source.close()
    cable.close()
    assert reading.gravity is not None
    assert reading.gravity[0] == pytest.approx(-math.sin(math.radians(3.0)))
    assert reading.gravity[1] == pytest.approx(math.sin(math.radians(4.0)))
    assert "cannot point" in bench.complaints[0]


def test_a_wrong_baud_rate_shows_as_a_line_without_end() -> None:
    assert "baud" in lines_read(b"\x00\xf8" * 1000)[1][0]


def test_one_that_must_be_asked_is_asked() -> None:
    sensor = SerialInclinometer()
    bench = Bench("inclinometer", {**sensor.options(), "request": "R\r", "request_hz": 50.0})
    bench.source.open()
    asked = b""
    deadline = time.monotonic() + PATIENCE_S
    while asked.count(b"R\r") < 3 and time.monotonic() < deadline:
        bench.source.read()
        asked += sensor.cable.read()
        time.sleep(0.005)
    sensor.say(math.radians(1.5))
    assert bench.wait()[0].angle_rad == pytest.approx(math.radians(1.5), abs=1e-5)
    bench.source.close()
    sensor.close()


def test_a_cable_that_is_pulled_is_an_error_to_be_survived() -> None:
    sensor = SerialInclinometer()
    bench = Bench("inclinometer", sensor.options())
    bench.source.open()
    sensor.close()
    with pytest.raises(OSError):  # noqa: PT011  # pyserial's and the system's words differ
        bench.wait()
    bench.source.close()


# --- typed in -------------------------------------------------------------------------------------------------------


def asked(text: str, *, stops: int, options: TypedOptions | None = None) -> tuple[list[float], str]:
    """Returns the degrees that a person types, and what the screen shows."""
    answers: queue.SimpleQueue[Reading] = queue.SimpleQueue()
    screen = io.StringIO()
    person = Person(
        answers,
        options=options or TypedOptions(),
        clock=SystemClock(),
        terminal=io.StringIO(text),
        screen=screen,
    )
    for stop in range(stops):
        person.ask(f"gauge, stop {stop + 1}")
    deadline = time.monotonic() + PATIENCE_S
    while answers.qsize() < stops and time.monotonic() < deadline:
        time.sleep(0.001)
    given = [answers.get() for _ in range(answers.qsize())]
    assert len(given) == stops  # no value is an answer too: nobody waits for it
    return [math.degrees(reading.angle_rad) for reading in given if not reading.absent], screen.getvalue()


def test_a_person_is_asked_until_the_answer_is_a_number() -> None:
    values, screen = asked("4,25\nfive\n5.25\n\n-1\n", stops=4)
    assert values == pytest.approx([4.25, 5.25, -1.0])
    assert "Expected a number in deg, such as 4.25; got 'five'." in screen
    assert screen.count("gauge, stop 2") == 2


def test_a_gauge_that_counts_the_other_way() -> None:
    assert asked("2.5\n", stops=1, options=TypedOptions(sign=-1))[0] == pytest.approx([-2.5])


def test_a_terminal_that_is_not_there_answers_with_no_value() -> None:
    assert asked("", stops=3)[0] == []


def test_a_list_of_values_is_taken_line_by_line(tmp_path: Path) -> None:
    (tmp_path / "gauge.txt").write_text("# Capri 20005\n0.1\n-\nsteep # a slip of the pen\n2,5\n", encoding="utf-8")
    bench = Bench("typed", {"file": str(tmp_path / "gauge.txt")})
    bench.source.open()
    values: list[list[float]] = []
    for step in range(5):
        bench.bus.publish("session/event", RunEvent(1, 1, "DWELL", "", step))
        bench.bus.publish("session/event", RunEvent(1, 1, "DONE", "", step))
        values.append([round(math.degrees(reading.angle_rad), 6) for reading in bench.source.read()])
    assert [len(given) for given in values] == [1] * 5
    assert [value for given in values for value in given if not math.isnan(value)] == [0.1, 2.5]
    assert "'steep'" in bench.complaints[0]
    assert "no line for this stop" in bench.complaints[1]

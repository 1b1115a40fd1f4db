"""The live view serves on the loopback address, thins out what is frequent, and is never in anybody's way."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest

from shared import messages as m
from shared.bus import Received
from shared.clock import SimulatedClock
from shared.memory_bus import MemoryBus
from station.view import viewer
from station.view.live import LiveView, StationTime
from station.view.scene import SceneLogger
from station.view.setup import Setup
from tests.unit.view import session

LISTENING = "0A"


def listening_addresses(port: int) -> set[str]:
    """The local addresses that listen on a port, as the kernel writes them."""
    found: set[str] = set()
    for table in ("tcp", "tcp6"):
        for line in Path(f"/proc/net/{table}").read_text().splitlines()[1:]:
            local, state = line.split()[1], line.split()[3]
            address, number = local.rsplit(":", 1)
            if state == LISTENING and int(number, 16) == port:
                found.add(address)
    return found


def port_of(view: LiveView) -> int:
    return int(view.uri.rsplit(":", 1)[1].split("/")[0])


@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="the kernel's table of sockets is Linux's")
def test_it_listens_on_the_loopback_address_alone() -> None:
    with LiveView(setup=Setup(), port=0) as view:
        assert listening_addresses(port_of(view)) == {"0100007F"}


def test_a_taken_port_is_given_up_for_a_free_one() -> None:
    with socket.socket() as other:
        other.bind((viewer.LOOPBACK, 0))
        other.listen()
        taken = other.getsockname()[1]
        with LiveView(setup=Setup(), port=taken) as view:
            assert port_of(view) != taken


def test_nobody_watching_a_whole_session_goes_through_and_closes() -> None:
    bus = MemoryBus(SimulatedClock())
    with LiveView(setup=Setup(), port=0) as view:
        view.attach(bus)
        for topic, message, _ in session.session_messages():
            bus.publish(topic, message)
    assert view.fault == ""
    assert "rerun --connect" in view.how_to_look
    view.close()  # a second time is nothing


def test_frequent_topics_are_thinned_out_before_decoding_but_corners_never(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[str] = []

    def log(_: SceneLogger, topic: str, message: m.Message, stamp_ns: int) -> None:
        drawn.append(topic)

    monkeypatch.setattr(SceneLogger, "log", log)
    taken: dict[str, int] = {}
    with LiveView(setup=Setup(), port=0) as view:
        for topic, message, stamp in session.session_messages():
            taken[topic] = taken.get(topic, 0) + 1
            view.take(Received(topic, receive_ns=stamp, message=message))
    assert drawn.count("camera/corners") == taken["camera/corners"]
    assert drawn.count("arm/joints") <= 15 * session.END_S + 1 < taken["arm/joints"]
    assert "camera/image/overlay" not in drawn


def test_a_drawing_that_cannot_keep_up_drops_and_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("station.view.live._CAPACITY", 3)

    def run(_: LiveView) -> None:
        """A drawing that hangs."""

    monkeypatch.setattr(LiveView, "_run", run)
    with LiveView(setup=Setup(), port=0) as view:
        for stamp in range(10):
            view.take(Received("log", receive_ns=stamp, payload=b""))
        assert view.dropped == {"log": 7}


def test_a_message_that_does_not_parse_is_remembered_and_the_view_goes_on() -> None:
    with LiveView(setup=Setup(), port=0) as view:
        view.take(Received("camera/corners", receive_ns=1, payload=b"\xff\xff\xff"))
        view.take(Received("session/event", receive_ns=2, message=m.RunEvent(stamp_ns=2, phase="TILT")))
    assert "MarkerCorners" in view.fault


def test_agents_stamps_are_moved_onto_the_stations_clock() -> None:
    time = StationTime()
    corners = m.MarkerCorners(capture_ns=1000)
    assert time.of("camera/corners", corners, receive_ns=5) == 1000
    time.of("clock", m.ClockOffset(stamp_ns=1, agent="camera", offset_ns=-300), receive_ns=5)
    assert time.of("camera/corners", corners, receive_ns=5) == 700
    assert time.of("arm/platform", m.PlatformState(stamp_ns=1000), receive_ns=5) == 1000
    assert time.of("arm/platform", m.PlatformState(), receive_ns=5) == 5

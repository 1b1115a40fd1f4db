"""`station deploy` counts the corners that arrive, on a real bus with an agent that is played here."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import pytest

from shared.clock import SystemClock
from shared.messages import AgentStatus, ClockPing, ClockPong, MarkerCorners, Message
from shared.zenoh_bus import ZenohBus
from station.app.deploy.verify import Arrival, watch
from tests.patience import PATIENCE_S
from tests.system.ports import free_port
from tests.unit.pi_agent.rigs import rig

pytestmark = pytest.mark.system
BOOT = 7

Corners = Callable[[int], tuple[int, int]]


def listened_to(corners: Corners, *, patience_s: float = PATIENCE_S, answer_s: float = 0.0) -> Arrival:
    """Returns what is found of an agent whose corners, at a time (ns), are of the boot and capture time given.

    It takes `answer_s` to answer a ping.
    """
    clock, stop, port = SystemClock(), threading.Event(), free_port()

    def answer(ping: Message) -> Message:
        assert isinstance(ping, ClockPing)
        time.sleep(answer_s)
        return ClockPong(station_ns=ping.station_ns, agent_ns=clock.now_ns())

    def play() -> None:
        with ZenohBus("test", listen=[f"tcp/127.0.0.1:{port}"], clock=clock) as bus:
            bus.serve("camera/clock", answer, direct=True)
            while not stop.is_set():
                bus.publish("camera/status", AgentStatus(stamp_ns=clock.now_ns(), boot_id=BOOT))
                boot_id, capture_ns = corners(clock.now_ns())
                bus.publish(
                    "camera/corners",
                    MarkerCorners(capture_ns=capture_ns, boot_id=boot_id, corners_px=(1.0,) * 8, found=True),
                )
                bus.poll(0.05)

    agent = threading.Thread(target=play)
    agent.start()
    try:
        return watch(rig(), f"tcp/127.0.0.1:{port}", seconds=0.5, patience_s=patience_s)
    finally:
        stop.set()
        agent.join(timeout=PATIENCE_S)


def test_a_slow_agents_corners_are_corners_and_their_latency_is_said() -> None:
    arrival = listened_to(lambda now_ns: (BOOT, now_ns - 1_500_000_000))
    assert arrival.corners > 1
    assert arrival.found == arrival.corners
    assert arrival.p50_ms > 1400.0


def test_an_agent_that_takes_long_to_answer_sends_corners_all_the_same() -> None:
    """An agent on a busy machine took minutes to be verified: it answered no ping within half a second."""
    arrival = listened_to(lambda now_ns: (BOOT, now_ns), answer_s=0.8, patience_s=10.0)
    assert arrival.corners > 1
    assert abs(arrival.offset_ms) < 500.0


@pytest.mark.parametrize("before", ["another agent", "before anybody listened"])
def test_what_was_seen_before_is_not_counted(before: str) -> None:
    began_ns = time.time_ns()

    def old(now_ns: int) -> tuple[int, int]:
        return (BOOT - 1, now_ns) if before == "another agent" else (BOOT, began_ns - 10**9)

    arrival = listened_to(old, patience_s=1.5)
    assert arrival.corners == 0
    assert arrival.fault == ""

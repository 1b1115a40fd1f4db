"""The bus within one process: who hears what, and that what nobody hears need not be made."""

from __future__ import annotations

from shared.bus import Received
from shared.clock import SimulatedClock
from shared.memory_bus import MemoryBus
from shared.messages import Heartbeat


def test_it_carries_what_somebody_hears() -> None:
    bus = MemoryBus(SimulatedClock())
    assert not bus.carries("session/heartbeat")
    bus.subscribe("session/heartbeat", lambda _: None)
    assert bus.carries("session/heartbeat")
    assert not bus.carries("tf")
    bus.subscribe("**", lambda _: None)
    assert bus.carries("tf")


def test_what_is_left_out_reaches_nobody() -> None:
    heard: list[Received] = []
    bus = MemoryBus(SimulatedClock(), left_out=frozenset({"session/heartbeat"}))
    for topic in ("**", "session/heartbeat", "camera/status"):
        bus.subscribe(topic, heard.append)
    bus.publish("session/heartbeat", Heartbeat())
    assert not heard
    assert not bus.carries("session/heartbeat")
    assert bus.carries("camera/status")

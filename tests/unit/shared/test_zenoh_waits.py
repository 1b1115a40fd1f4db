"""Who publishes never waits for a link that takes nothing."""

from __future__ import annotations

import threading
from typing import Any

import pytest

from shared.foxglove import Log
from shared.messages import PlatformState
from shared.zenoh_bus import ZenohBus


class _Stuck:
    """A publisher whose link takes nothing until it is freed."""

    def __init__(self) -> None:
        self.free, self.sent = threading.Event(), list[bytes]()

    def put(self, payload: bytes) -> None:
        self.free.wait(30.0)
        self.sent.append(payload)

    def undeclare(self) -> None:
        pass


def test_a_message_that_must_arrive_waits_behind_the_publisher(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lines of the log wait for the link; the attitude goes on, and the lines come in their order afterwards."""
    log, attitude = _Stuck(), _Stuck()
    attitude.free.set()
    publishers: dict[str, Any] = {"log": log, "arm/platform": attitude}
    with ZenohBus("waits") as bus:
        monkeypatch.setattr(bus, "_declare_publisher", publishers.__getitem__)
        for text in ("one", "two"):
            bus.publish("log", Log(message=text))
            bus.publish("arm/platform", PlatformState())
        assert len(attitude.sent) == 2
        assert log.sent == []
        log.free.set()
    assert [b"one" in log.sent[0], b"two" in log.sent[1]] == [True, True]

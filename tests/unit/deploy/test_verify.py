"""A deployment goes on listening to a camera until its corners tell a rate."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import pytest

from shared.bus import Received
from shared.clock import SystemClock
from shared.messages import AgentStatus, ClockPong, MarkerCorners, Message
from station.app.deploy import verify
from station.app.deploy.verify import ENOUGH, watch
from tests.unit.pi_agent.rigs import rig

BOOT = 7
SECONDS, GAP_S = 0.1, 0.4


class BusyCamera:
    """A bus on which one frame comes, then none for GAP_S, which is longer than the listening, then `more` frames."""

    status = AgentStatus(boot_id=BOOT, version="9")

    def __init__(self, more: int) -> None:
        self.more, self.handlers = more, dict[str, Callable[[Received], None]]()
        self.began_s: float | None = None

    def __enter__(self) -> BusyCamera:
        return self

    def __exit__(self, *_: object) -> None:
        """Nothing is open."""

    def subscribe(self, topic: str, handler: Callable[[Received], None]) -> None:
        self.handlers[topic] = handler

    def request(self, _: str, ping: Any, on_reply: Callable[[Message], None], **__: Any) -> None:
        on_reply(ClockPong(station_ns=ping.station_ns, agent_ns=SystemClock().now_ns()))
        self._tell("camera/status", self.status)

    def poll(self, timeout_s: float) -> None:
        time.sleep(0.5 * timeout_s)
        if self.began_s is None:
            self.began_s = time.monotonic()
        elif time.monotonic() < self.began_s + GAP_S or not self.more:
            return
        else:
            self.more -= 1
        self._tell("camera/corners", MarkerCorners(capture_ns=SystemClock().now_ns(), found=True, boot_id=BOOT))

    def _tell(self, topic: str, message: Message) -> None:
        self.handlers[topic](Received(topic=topic, message=message, receive_ns=SystemClock().now_ns()))


def heard(monkeypatch: pytest.MonkeyPatch, more: int) -> verify.Arrival:
    def bus(*_: Any, **__: Any) -> BusyCamera:
        return BusyCamera(more)

    monkeypatch.setattr(verify, "ZenohBus", bus)
    return watch(rig(), "tcp/127.0.0.1:1", seconds=SECONDS, patience_s=2.0)


def test_a_camera_that_is_slow_at_first_has_a_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    """One frame has none, and was said to come at 0.0 Hz."""
    arrival = heard(monkeypatch, more=50)
    assert arrival.corners >= ENOUGH
    assert arrival.found == arrival.corners
    assert arrival.rate_hz > 0


def test_it_gives_up_on_a_camera_that_never_has_one(monkeypatch: pytest.MonkeyPatch) -> None:
    assert heard(monkeypatch, more=0).corners == 1


def test_the_agents_words_are_visible(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(BusyCamera, "status", AgentStatus(boot_id=BOOT, version="9\x1b[2J", fault="no light\x07"))
    assert str(heard(monkeypatch, more=0)).endswith("agent 9␛[2J; the agent says: no light␇")


def test_what_came_in_place_of_corners_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Corners of another life of the agent are none of this one's."""
    monkeypatch.setattr(BusyCamera, "status", AgentStatus(boot_id=BOOT + 1))
    arrival = heard(monkeypatch, more=3)
    assert (arrival.corners, arrival.stale) == (0, 4)
    assert arrival.answered > 0
    assert arrival.heard == (
        f"the agent told no fault; it answered {arrival.answered} pings, and 4 corners came that may be of before"
    )

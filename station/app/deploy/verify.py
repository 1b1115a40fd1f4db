"""Verifies that corners arrive: listens on the bus as the station would, and measures rate and latency."""

from __future__ import annotations

import threading
import time
from collections import deque
from dataclasses import dataclass, field

import numpy as np

from shared.bus import Bus, Received
from shared.clock import Clock, SystemClock
from shared.messages import AgentStatus, ClockPing, ClockPong, MarkerCorners, Message
from shared.rig import RigConfig
from shared.visible import visible
from shared.zenoh_bus import ZenohBus
from station.app.clocks import RoundTrip, best_of

ENOUGH = 5
"""The fewest corners by which a camera's rate is told."""

PING_S, ANSWER_S = 0.05, 10.0
"""Pings follow the answers to the ones before, no faster than this; and how long a busy agent may take to answer. Until
one is answered no corners can be told from an earlier agent's."""


@dataclass(frozen=True, kw_only=True)
class Arrival:
    """The messages that came in `seconds`: corners by capture time, latency from capture to this computer's handler.

    `offset_ms` is this clock less the agent's, `sigma_ms` its standard error; NaN where nothing came. `stale` are
    corners that may be of before, and `answered` the pings that the agent answered.
    """

    corners: int
    found: int
    rate_hz: float
    p50_ms: float
    p99_ms: float
    offset_ms: float
    sigma_ms: float
    dropped: int
    version: str
    fault: str
    stale: int = 0
    answered: int = 0

    @property
    def heard(self) -> str:
        """The words for what came in place of corners."""
        said = self.fault or "the agent told no fault"
        return f"{said}; it answered {self.answered} pings, and {self.stale} corners came that may be of before"

    def __str__(self) -> str:
        """Returns one line for the terminal."""
        fault = f"; the agent says: {self.fault}" if self.fault else ""
        return (
            f"{self.corners} corners at {self.rate_hz:.3g} Hz, marker found in {self.found}, {self.dropped} frames "
            f"dropped; capture to station {self.p50_ms:.1f} ms (median), {self.p99_ms:.1f} ms (99 %); "
            f"station less agent clock {self.offset_ms:+.3f} ± {self.sigma_ms:.3f} ms; agent {self.version}{fault}"
        )


@dataclass
class _Listener:
    """Collects what was captured since `since_ns`; `(capture, receive)` times in nanoseconds, each by its own clock."""

    since_ns: int
    times: list[tuple[int, int]] = field(default_factory=list[tuple[int, int]])
    found: int = 0
    stale: int = 0
    status: AgentStatus | None = None
    trips: deque[RoundTrip] = field(default_factory=deque[RoundTrip])

    def corners(self, received: Received) -> None:
        message = received.message
        if not isinstance(message, MarkerCorners):
            return
        if not self._fresh(message):
            self.stale += 1
            return
        self.times.append((message.capture_ns, received.receive_ns))
        self.found += message.found

    def _fresh(self, message: MarkerCorners) -> bool:
        """Returns true if it is neither of an earlier agent's cache nor from before anybody listened, however slow."""
        if not self.trips or self.status is None or message.boot_id != self.status.boot_id:
            return False
        return message.capture_ns + best_of(self.trips)[0].offset_ns > self.since_ns

    def took_status(self, received: Received) -> None:
        message = received.message
        if isinstance(message, AgentStatus):
            self.status = message


def watch(rig: RigConfig, endpoint: str, *, seconds: float, patience_s: float) -> Arrival:
    """Listens at `endpoint` for `seconds` from the first corners on, and until there are ENOUGH of them.

    It gives up after `patience_s`. A busy Pi may send one frame in the first second, and one frame has no rate.
    """
    clock = SystemClock()
    heard = _Listener(clock.now_ns())
    with ZenohBus(rig.id, connect=[endpoint], clock=clock) as bus:
        bus.subscribe("camera/corners", heard.corners)
        bus.subscribe("camera/status", heard.took_status)
        until = give_up = time.monotonic() + patience_s
        next_ping, answered = 0.0, threading.Event()
        answered.set()
        while time.monotonic() < (until if len(heard.times) >= ENOUGH else give_up):
            if answered.is_set() and time.monotonic() >= next_ping:
                next_ping = time.monotonic() + PING_S
                _ping(bus, clock, heard.trips, answered)
            before = len(heard.times)
            bus.poll(0.02)
            if not before and heard.times:
                until = time.monotonic() + seconds
                give_up = max(give_up, until)
    return _arrival(heard)


def _ping(bus: Bus, clock: Clock, trips: deque[RoundTrip], answered: threading.Event) -> None:
    answered.clear()
    sent_ns = clock.now_ns()

    def on_reply(reply: Message | None) -> None:
        back_ns = clock.now_ns()
        if isinstance(reply, ClockPong):
            trips.append(RoundTrip((sent_ns + back_ns) // 2 - reply.agent_ns, back_ns - sent_ns))
        answered.set()

    bus.request("camera/clock", ClockPing(station_ns=sent_ns), on_reply, timeout_s=ANSWER_S, direct=True)


def _arrival(heard: _Listener) -> Arrival:
    best, sigma_ns = best_of(heard.trips) if heard.trips else (None, 0)
    offset_ns = best.offset_ns if best else 0
    delays = np.array([receive - capture - offset_ns for capture, receive in heard.times], dtype=np.float64) * 1e-6
    count, status = len(delays), heard.status or AgentStatus()
    span_s = (heard.times[-1][0] - heard.times[0][0]) * 1e-9 if count > 1 else 0.0
    return Arrival(
        corners=count,
        found=heard.found,
        rate_hz=(count - 1) / span_s if span_s > 0 else 0.0,
        p50_ms=float(np.percentile(delays, 50)) if count else float("nan"),
        p99_ms=float(np.percentile(delays, 99)) if count else float("nan"),
        offset_ms=offset_ns * 1e-6 if best else float("nan"),
        sigma_ms=sigma_ns * 1e-6 if best else float("nan"),
        dropped=status.dropped,
        version=visible(status.version),
        fault=visible(status.fault) if heard.status else "nothing: no status came",
        stale=heard.stale,
        answered=len(heard.trips),
    )

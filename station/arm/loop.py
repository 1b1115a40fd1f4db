"""The arm agent in real time: polls the bus, ticks at a steady rate, and obeys the process's signals."""

from __future__ import annotations

import contextlib
from collections.abc import Generator
from dataclasses import dataclass, field
from threading import Event
from types import FrameType

from shared.bus import Bus
from shared.clock import Clock
from shared.messages import ClockPing, ClockPong, Message
from shared.system.processes import EMERGENCY, ENDING
from shared.system.signals import handling
from station.arm.agent import ArmAgent

RATE_HZ = 125.0


@dataclass(frozen=True, slots=True)
class Requests:
    """Requests to the loop from outside: `ending` ends it, `emergency` stops the arm at once."""

    ending: Event = field(default_factory=Event)
    emergency: Event = field(default_factory=Event)


@contextlib.contextmanager
def signals(requests: Requests) -> Generator[None]:
    """Lets signals end the loop with the arm held, or stop the arm at once: see shared/system/processes.py."""

    def on_signal(number: int, frame: FrameType | None) -> None:
        del frame
        (requests.emergency if number in EMERGENCY else requests.ending).set()

    with handling(on_signal, (*ENDING, *EMERGENCY)):
        yield


def serve_clock(bus: Bus, clock: Clock) -> None:
    """Answers clock pings on the receiving thread, so that the round trip is short."""

    def pong(message: Message) -> ClockPong:
        station_ns = message.station_ns if isinstance(message, ClockPing) else 0
        return ClockPong(station_ns=station_ns, agent_ns=clock.now_ns())

    bus.serve("arm/clock", pong, direct=True)


def run(agent: ArmAgent, *, bus: Bus, clock: Clock, requests: Requests, rate_hz: float = RATE_HZ) -> None:
    """Drives the agent until `requests.ending`; the arm is then held where it is.

    Ticks that were missed (a busy machine) are not made up for: the next one samples the motion at its own time.
    """
    period_ns = round(1e9 / rate_hz)
    serve_clock(bus, clock)
    due_ns = clock.now_ns()
    try:
        while not requests.ending.is_set():
            now_ns = clock.now_ns()
            if now_ns < due_ns:
                bus.poll((due_ns - now_ns) * 1e-9)
                continue
            bus.poll()
            if requests.emergency.is_set():
                requests.emergency.clear()
                agent.stop("signal")
            agent.tick(clock.now_ns())
            due_ns = max(due_ns + period_ns, now_ns)
    finally:
        agent.close(now_ns=clock.now_ns())

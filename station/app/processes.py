"""Keeps a long-running process at its pace, and ends it cleanly when it is asked to."""

from __future__ import annotations

import signal
import threading
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

from shared.bus import Bus
from shared.clock import Clock
from shared.system.signals import handling


@dataclass(slots=True)
class StopRequest:
    """The reason of an early end of a session, set by a signal or by the recorder."""

    reason: str = ""
    times: int = 0

    def ask(self, reason: str) -> None:
        """Asks for the end; asking again is remembered."""
        self.reason = self.reason or reason
        self.times += 1


@contextmanager
def stop_by_signal() -> Generator[StopRequest]:
    """Turns Ctrl-C, and what else asks a process to end, into a request for a safe end."""
    stop = StopRequest()

    def handler(number: int, _frame: FrameType | None) -> None:
        stop.ask("stopped by the user" if number == signal.SIGINT else "stopped by a signal")

    with handling(handler):
        yield stop


def paced(clock: Clock, bus: Bus, *, rate_hz: float, stopped: threading.Event) -> Iterator[int]:
    """Polls the bus and gives the time, `rate_hz` times a second; turns that were missed are not made up for."""
    period_ns = round(1e9 / rate_hz)
    due_ns = clock.now_ns()
    while not stopped.is_set():
        now_ns = clock.now_ns()
        if now_ns < due_ns:
            bus.poll((due_ns - now_ns) * 1e-9)
            continue
        bus.poll()
        yield now_ns
        due_ns = max(due_ns + period_ns, now_ns - period_ns)

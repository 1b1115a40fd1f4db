"""Keeps a long-running process at its pace, and ends it cleanly when it is asked to."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

from shared.bus import Bus
from shared.clock import Clock
from shared.system.processes import ENDING


@contextmanager
def until_stopped() -> Generator[threading.Event]:
    """An event that Ctrl-C sets, and what else asks a process to end (shared/system/processes.py)."""
    stopped = threading.Event()

    def handler(_number: int, _frame: FrameType | None) -> None:
        stopped.set()

    with _handling(handler):
        yield stopped


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
    """Ctrl-C, and what else asks a process to end, ask for a safe end."""
    stop = StopRequest()

    def handler(number: int, _frame: FrameType | None) -> None:
        stop.ask("stopped by the user" if number == signal.SIGINT else "stopped by a signal")

    with _handling(handler):
        yield stop


@contextmanager
def _handling(handler: Callable[[int, FrameType | None], None]) -> Generator[None]:
    """Has a handler take the signals that ask for the end; only the main thread hears of them."""
    heard = ENDING if threading.current_thread() is threading.main_thread() else ()
    before = {number: signal.signal(number, handler) for number in heard}
    try:
        yield
    finally:
        for number, old in before.items():
            signal.signal(number, old)


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

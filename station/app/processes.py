"""What every long-running process of the station does alike: keep a pace, and end cleanly when asked to."""

from __future__ import annotations

import signal
import threading
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from types import FrameType

from shared.bus import Bus
from shared.clock import Clock


@contextmanager
def until_stopped() -> Generator[threading.Event]:
    """An event that Ctrl-C and SIGTERM set."""
    stopped = threading.Event()

    def handler(_number: int, _frame: FrameType | None) -> None:
        stopped.set()

    before = {number: signal.signal(number, handler) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stopped
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

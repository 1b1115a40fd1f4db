"""Hears the signals that ask a process to end, for as long as a block runs and not longer.

A handler that is left behind is inherited by every process that is forked later: one that only sets an event keeps a
worker of a pool alive for ever, as its pool ends it by SIGTERM.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Generator, Iterable
from contextlib import contextmanager
from types import FrameType

from shared.system.processes import ENDING

CAN_HOLD = hasattr(signal, "pthread_sigmask")
"""True if signals can be held back, which Windows cannot do."""

Handler = Callable[[int, FrameType | None], None]


@contextmanager
def handling(handler: Handler, heard: Iterable[signal.Signals] = ENDING) -> Generator[None]:
    """Has a handler take these signals within the block; outside the main thread, which alone hears them, none."""
    mine = tuple(heard) if threading.current_thread() is threading.main_thread() else ()
    before = {number: signal.signal(number, handler) for number in mine}
    try:
        yield
    finally:
        for number, old in before.items():
            signal.signal(number, old)


@contextmanager
def until_stopped() -> Generator[threading.Event]:
    """Provides an event that Ctrl-C sets, as does what else asks a process to end (shared/system/processes.py)."""
    stopped = threading.Event()

    def handler(_number: int, _frame: FrameType | None) -> None:
        stopped.set()

    with handling(handler):
        yield stopped


@contextmanager
def ctrl_c_held() -> Generator[None]:
    """Holds Ctrl-C back within the block; processes and threads that are started in it never hear it.

    Where a system cannot, nothing is held.
    """
    if not CAN_HOLD:
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)

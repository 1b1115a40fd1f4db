"""The terminal: a program that moves a plate never waits for whoever reads what it prints, and prints every letter."""

from __future__ import annotations

import atexit
import contextlib
import io
import os
import queue
import sys
import threading
import time
from typing import Any, BinaryIO, TextIO, cast

_PIECES = 1000
"""The most pieces that wait for a terminal."""
_STALLED_S = 1.0
"""A terminal that has taken nothing for this time stands still."""
_LAST_S = 60.0
"""The time that the last lines wait for a terminal that stands still: whoever stopped it to read lets it go on."""


class _Terminal:
    """Writes on a thread of its own, for a terminal may stand still for hours, or be closed.

    Ctrl-S, text that is being marked in a Windows console, a connection that is frozen: whoever wrote to it then would
    stand still as well, with a tilted plate. What nobody reads is kept, as far as there is room, or forgotten.
    """

    def __init__(self) -> None:
        self._waiting: queue.Queue[tuple[int, bytes]] = queue.Queue(_PIECES)
        self._began_s = time.monotonic()
        threading.Thread(target=self._write_all, name="terminal", daemon=True).start()
        atexit.register(self._finish)

    def take(self, descriptor: int, piece: bytes) -> None:
        """Takes a piece at once, unless the terminal is merely slow: then its turn is waited for."""
        while True:
            with contextlib.suppress(queue.Full):
                return self._waiting.put_nowait((descriptor, piece))
            if time.monotonic() - self._began_s > _STALLED_S:
                return None
            time.sleep(0.01)

    def _write_all(self) -> None:
        while True:
            descriptor, piece = self._waiting.get()
            with contextlib.suppress(OSError):  # it is closed
                while piece:
                    self._began_s = time.monotonic()
                    piece = piece[os.write(descriptor, piece) :]
            self._began_s = time.monotonic()
            self._waiting.task_done()

    def _finish(self) -> None:
        """Lets what was printed last be read, if anybody reads."""
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        end_s = time.monotonic() + _LAST_S
        while self._waiting.unfinished_tasks and time.monotonic() < end_s:
            time.sleep(0.005)


class _Lasting(io.FileIO):
    """A stream to a terminal or a pipe that never keeps its writer waiting."""

    terminal: _Terminal

    def write(self, data: Any, /) -> int:
        """Takes everything."""
        piece = bytes(data)
        self.terminal.take(self.fileno(), piece)
        return len(piece)


def outlive_terminal() -> None:
    """Lets this process go on when its terminal is closed or stands still: it has a plate to bring back to level."""
    terminal = _Terminal()
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if isinstance(stream, io.TextIOWrapper):
            stream.flush()
            setattr(sys, name, _lasting(stream, terminal))


def _lasting(stream: io.TextIOWrapper, terminal: _Terminal) -> io.TextIOWrapper:
    """Returns the same stream by way of the terminal's thread; what was printed at once (PYTHONUNBUFFERED) still is."""
    raw = _Lasting(stream.fileno(), "w", closefd=False)
    raw.terminal = terminal
    at_once = stream.write_through
    return io.TextIOWrapper(
        cast(BinaryIO, raw) if at_once else io.BufferedWriter(raw),
        stream.encoding,
        stream.errors,
        line_buffering=stream.line_buffering,
        write_through=at_once,
    )


def print_all_letters(*streams: TextIO) -> None:
    """Has streams that know few letters (a pipe or a file on Windows: those of one language) written in UTF-8."""
    for stream in streams:
        if isinstance(stream, io.TextIOWrapper) and stream.encoding.lower().replace("-", "") != "utf8":
            stream.reconfigure(encoding="utf-8")

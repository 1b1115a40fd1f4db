"""The agent's log: on the bus for the recording, on standard error for whoever started it."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

from shared.clock import Clock
from shared.foxglove import LEVELS, Log, Timestamp

NAME = "camera"


class Journal:
    """Writes log lines; `send` takes a topic and a message, and must not keep the camera waiting."""

    def __init__(self, send: Callable[[str, Log], None], clock: Clock) -> None:
        self._send, self._clock = send, clock

    def info(self, text: str) -> None:
        """Logs something that happened."""
        self._write("info", text)

    def warning(self, text: str) -> None:
        """Logs something that the measurement survives."""
        self._write("warning", text)

    def error(self, text: str) -> None:
        """Logs something that stops the measurement until it is mended."""
        self._write("error", text)

    def _write(self, level: str, text: str) -> None:
        now_ns = self._clock.now_ns()
        line = Log(timestamp=Timestamp.from_ns(now_ns), level=LEVELS[level], message=text, name=NAME)
        self._send("log", line)
        print(f"{time.strftime('%H:%M:%S')} pi-agent {level}: {text}", file=sys.stderr, flush=True)

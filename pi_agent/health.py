"""Watches the process and its machine: systemd's watchdog, processor time, temperature, version."""

from __future__ import annotations

import contextlib
import os
import socket
import time
from collections.abc import Mapping
from pathlib import Path

THERMAL = Path("/sys/class/thermal/thermal_zone0/temp")


class Watchdog:
    """Speaks to systemd by sd_notify(3); does nothing when systemd did not start the process.

    It is patted only after a fresh frame, so that a camera that has died brings a restart.
    """

    def __init__(self, environment: Mapping[str, str] = os.environ) -> None:
        self._address = environment.get("NOTIFY_SOCKET", "")
        if self._address.startswith("@"):
            self._address = "\0" + self._address[1:]  # an abstract socket
        limit_us = environment.get("WATCHDOG_USEC", "")
        self._interval_s = 1e-6 * int(limit_us) / 5 if limit_us.isdigit() else 0.0
        self._patted_s = float("-inf")

    def ready(self) -> None:
        """Tells systemd that the agent has begun its work."""
        self._send("READY=1")

    def stopping(self) -> None:
        """Tells systemd that the agent is about to end."""
        self._send("STOPPING=1")

    def say(self, status: str) -> None:
        """Sends one line for `systemctl status`."""
        self._send("STATUS=" + status.replace("\n", " "))

    def fresh_frame(self) -> None:
        """Pats the watchdog when a frame has come, five times within its limit."""
        now_s = time.monotonic()
        if self._interval_s and now_s - self._patted_s >= self._interval_s:
            self._patted_s = now_s
            self._send("WATCHDOG=1")

    def _send(self, message: str) -> None:
        if not self._address:
            return
        with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as notify:
            notify.sendto(message.encode(), self._address)


class ProcessorMeter:
    """The share of one core that this process takes, in percent (above 100: several cores)."""

    def __init__(self) -> None:
        self._wall_s, self._busy_s = time.monotonic(), time.process_time()

    def percent(self) -> float:
        """Returns the mean since the last call."""
        wall_s, busy_s = time.monotonic(), time.process_time()
        passed_s = wall_s - self._wall_s
        share = 100.0 * (busy_s - self._busy_s) / passed_s if passed_s > 0 else 0.0
        self._wall_s, self._busy_s = wall_s, busy_s
        return share


def temperature_c(path: Path = THERMAL) -> float:
    """Returns the processor's temperature; NaN where the machine does not tell."""
    try:
        return 1e-3 * int(path.read_text())
    except (OSError, ValueError):
        return float("nan")

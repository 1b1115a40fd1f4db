"""Follows whatever session runs on the rig's bus, one after another, and tells a page of it."""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from shared.bus import Bus, Received
from shared.foxglove import Log
from shared.messages import CameraGeometry, Heartbeat, Sample, SessionStatus
from station.app.display.watched import TOPICS, Watched
from station.sampling.plan import Plan

_LINES = 50
"""Lines of the log that a page shows: some minutes of a session."""
_UNNAMED = "recording.mcap"


class Follower:
    """The newest session on a bus. It is fed on the thread that polls the bus, and asked from any other."""

    def __init__(self, bus: Bus, folder: Path, *, elsewhere: Sequence[Path] = (), nominal_hz: float = 0.0) -> None:
        """`folder` is where sessions are recorded to, and `elsewhere` they may lie too; the disk is that of theirs.

        `nominal_hz` is the rate of the rig's camera.
        """
        self._bus, self._folder = bus, folder
        self._elsewhere, self._nominal_hz = elsewhere, nominal_hz
        self._lock = threading.Lock()
        self._owner: str | None = None
        self._geometry: CameraGeometry | None = None
        self._lines: deque[str] = deque(maxlen=_LINES)
        self._began = 0
        self._begin()
        for topic in (*TOPICS, "session/heartbeat", "log"):
            bus.subscribe(topic, self.take)

    def _begin(self) -> None:
        path = self._folder / _UNNAMED
        self._watched = Watched(Plan(), path, nominal_hz=self._nominal_hz, elsewhere=self._elsewhere)
        self._samples = list[Sample]()
        self._status: SessionStatus | None = None
        self._began += 1

    def expect(self) -> None:
        """Begins anew before another session is heard: one that was started is none of the last one's."""
        with self._lock:
            self._begin()
            self._owner = None

    def take(self, received: Received) -> None:
        """Takes a message."""
        message = received.message
        with self._lock:
            if isinstance(message, Heartbeat):
                self._hear(message)
            elif isinstance(message, Log):
                self._lines.append(f"{message.name}: {message.message}")
            else:
                if isinstance(message, SessionStatus):
                    self._status = message
                elif isinstance(message, CameraGeometry):
                    self._geometry = message.if_calibrated()
                elif isinstance(message, Sample):
                    self._samples.append(message)
                self._watched.take(received)

    def _hear(self, beat: Heartbeat) -> None:
        """Begins anew with another session; what came before the very first heartbeat was of its session already."""
        if self._owner is not None and beat.owner != self._owner:
            self._begin()
        self._owner = beat.owner

    @property
    def began(self) -> int:
        """The number of the session since the follower began: one that differs is another session."""
        with self._lock:
            return self._began

    def state(self) -> dict[str, Any]:
        """Returns the session at this moment, for the page."""
        alive = self._bus.alive()
        with self._lock:
            status, began, lines = self._status, self._began, list(self._lines)
            ended = "station" not in alive and (status is not None or bool(self._samples))
            moment = self._watched.moment(ended=ended)
        shown = asdict(moment) | {"lines": lines, "total": moment.total if status else None}
        here = {"recording": status.recording if status else "", "running": "station" in alive, "ended": ended}
        return shown | here | {"session": began, "alive": sorted(alive)}

    def samples(self) -> tuple[int, list[Sample], CameraGeometry | None]:
        """Returns the number of the session, its samples so far, and the camera's geometry if it is known."""
        with self._lock:
            return self._began, list(self._samples), self._geometry


def table_rows(samples: Sequence[Sample]) -> list[dict[str, Any]]:
    """Samples as the page's table shows them, in degrees."""
    return [
        {
            "run": sample.run,
            "direction": sample.direction,
            "azimuth_deg": _finite(math.degrees(sample.azimuth_rad)),
            "onset_deg": _finite(math.degrees(sample.onset_angle_rad)),
            "sigma_deg": _finite(math.degrees(sample.onset_sigma_rad)),
            "censored": sample.censored,
            "flags": list(sample.flags),
        }
        for sample in samples
    ]


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None

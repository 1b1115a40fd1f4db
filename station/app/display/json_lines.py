"""A session for scripts: one JSON object a line, with its kind in `event` and units in the names.

| event | when | fields |
|---|---|---|
| start | first | recording, total, notes (what a simulated rig conceals on purpose) |
| phase | a phase begins | time_ns, run, phase, reason |
| sample | a run is over | time_ns, run, direction, onset_deg, onset_sigma_deg, censored, flags |
| status | about once a second | those of `Moment`: tilt, distance to the threshold, samples by direction, health |
| log | a line of the log | level, text |
| end | last | recording, samples, fault (empty: the plan was carried out) |

Times are nanoseconds since 1970 on the station's clock, in simulated time on the simulation's.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, TextIO

from shared.bus import Bus, Received
from shared.messages import RunEvent, Sample
from station.app.display.watched import Watched

EVERY_S = 1.0
_WITHIN_A_PHASE = frozenset({"STEP_BEGIN", "STEP_END", "SYNC"})


class JsonLinesDisplay:
    """Writes the lines to a stream, each at once."""

    def __init__(
        self,
        out: TextIO,
        watched: Watched,
        *,
        path: Path,
        total: int,
        notes: Sequence[str] = (),
        seconds: Callable[[], float] = time.monotonic,
    ) -> None:
        """`notes` are told at the start."""
        self._out, self._watched, self._path, self._total, self._seconds = out, watched, path, total, seconds
        self._notes, self._last_s = list(notes), seconds()
        self._samples = 0

    def __enter__(self) -> JsonLinesDisplay:
        """Says what begins."""
        self._write("start", recording=str(self._path), total=self._total, notes=self._notes)
        return self

    def __exit__(self, *_: object) -> None:
        """Does nothing: nothing is left to be done."""

    def attach(self, bus: Bus) -> None:
        """Follows the session on this bus."""
        self._watched.attach(bus)
        bus.subscribe("session/event", self._on_event)
        bus.subscribe("session/sample", self._on_sample)

    def line(self, level: str, text: str) -> None:
        """Writes a line of the log."""
        self._write("log", level=level, text=text)

    def tell(self, done: int) -> None:
        """Writes the status when it is due."""
        del done
        if self._seconds() - self._last_s >= EVERY_S:
            self._last_s = self._seconds()
            self._write("status", **asdict(self._watched.moment()))

    def end(self, fault: str) -> None:
        """Says that this was all."""
        self._write("end", recording=str(self._path), samples=self._samples, fault=fault)

    def _on_event(self, received: Received) -> None:
        event = received.message
        if isinstance(event, RunEvent) and event.phase not in _WITHIN_A_PHASE:
            self._write("phase", time_ns=event.stamp_ns, run=event.run, phase=event.phase, reason=event.reason)

    def _on_sample(self, received: Received) -> None:
        sample = received.message
        if not isinstance(sample, Sample):
            return
        self._samples += 1
        self._write(
            "sample",
            time_ns=sample.detect_ns,
            run=sample.run,
            direction=sample.direction,
            onset_deg=_degrees(sample.onset_angle_rad),
            onset_sigma_deg=_degrees(sample.onset_sigma_rad),
            censored=sample.censored,
            flags=list(sample.flags),
        )

    def _write(self, event: str, **fields: Any) -> None:
        self._out.write(json.dumps({"event": event, **fields}, ensure_ascii=False) + "\n")
        self._out.flush()


def _degrees(angle_rad: float) -> float | None:
    """Returns None for what is unknown: JSON has no nan."""
    return math.degrees(angle_rad) if math.isfinite(angle_rad) else None

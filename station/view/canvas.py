"""A Rerun recording with one clock: what is logged stands at the time of its message."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np
import rerun as rr

from station.view.entities import ELAPSED, TIME

_BATCH = 256


class Canvas:
    """Logs below `root`, so that two sessions (recorded, simulated) can stand side by side in one recording.

    Curves are gathered and sent in batches, which costs a tenth of single points; `flush` sends what is left.
    """

    def __init__(self, recording: rr.RecordingStream, *, root: str = "", start_ns: int | None = None) -> None:
        self.recording = recording
        self.root = root
        self.start_ns = start_ns
        self.now_ns = start_ns or 0
        self._set_ns: int | None = None
        self._looks: dict[str, tuple[rr.AsComponents, ...]] = {}
        self._curves: defaultdict[str, list[tuple[int, tuple[float, ...]]]] = defaultdict(list)

    def at(self, stamp_ns: int) -> None:
        """Sets the time of what is logged next."""
        if self.start_ns is None:
            self.start_ns = stamp_ns
        self.now_ns = stamp_ns

    def log(self, path: str, *archetypes: rr.AsComponents) -> None:
        """Logs at the present time."""
        if path in self._looks:
            self.static(path, *self._looks.pop(path))
        if self._set_ns != self.now_ns:  # most messages only add to curves, which carry their own times
            self._set_ns = self.now_ns
            self.recording.set_time(TIME, timestamp=np.datetime64(self.now_ns, "ns"))
            self.recording.set_time(ELAPSED, duration=np.timedelta64(self.now_ns - (self.start_ns or 0), "ns"))
        self.recording.log(self.root + path, *archetypes)

    def look(self, path: str, *archetypes: rr.AsComponents) -> None:
        """Says how what is logged at `path` will look: sent once, before the first that is logged there.

        Later logs then need places alone, which costs a third less. Looks without anything to look at are errors to
        the viewer, hence not sent by themselves.
        """
        self._looks[path] = (*self._looks.get(path, ()), *archetypes)

    def static(self, path: str, *archetypes: rr.AsComponents) -> None:
        """Logs for all times."""
        self.recording.log(self.root + path, *archetypes, static=True)

    def curve(self, path: str, *values: float) -> None:
        """Adds a point to the curves at `path`, as many as there are values (always the same number)."""
        points = self._curves[path]
        points.append((self.now_ns, values))
        if len(points) >= _BATCH:
            self._send(path)

    def gap(self, path: str) -> None:
        """Breaks the curve at `path`, so that no line is drawn to the next point."""
        self.curve(path, float("nan"))

    def name_curves(
        self,
        path: str,
        names: Sequence[str],
        colors: Sequence[tuple[int, int, int]],
        *,
        width: float = 1.5,
    ) -> None:
        """Says what the curves at `path` are called and how they look."""
        self.static(path, rr.SeriesLines(names=list(names), colors=list(colors), widths=[width] * len(names)))

    def flush(self) -> None:
        """Sends the curves' points gathered so far; does not wait for anybody to take them."""
        for path in list(self._curves):
            self._send(path)

    def _send(self, path: str) -> None:
        points = self._curves[path]
        if not points:
            return
        stamps = np.array([stamp_ns for stamp_ns, _ in points], dtype=np.int64)
        values = np.array([values for _, values in points])
        points.clear()
        start_ns = self.start_ns or 0
        self.recording.send_columns(
            self.root + path,
            indexes=[
                rr.TimeColumn(TIME, timestamp=stamps.astype("datetime64[ns]")),
                rr.TimeColumn(ELAPSED, duration=(stamps - start_ns).astype("timedelta64[ns]")),
            ],
            columns=rr.Scalars.columns(scalars=values.ravel()).partition([values.shape[1]] * len(values)),
        )


class Cap:
    """Lets at most `rate_hz` a second through, by the messages' own time; None lets everything through."""

    def __init__(self, rate_hz: float | None) -> None:
        self._period_ns = 0 if rate_hz is None else int(0.95e9 / rate_hz)
        self._last_ns: int | None = None

    def due(self, stamp_ns: int) -> bool:
        """Returns true if this one passes. Time that steps back (a new recording) starts anew."""
        if self._last_ns is not None and 0 <= stamp_ns - self._last_ns < self._period_ns:
            return False
        self._last_ns = stamp_ns
        return True


def named(folder: str, name: str) -> str:
    """Returns the entity in a folder of what a message names: a name may hold letters that separate entities."""
    return folder + rr.escape_entity_path_part(name or "unnamed")

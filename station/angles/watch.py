"""Watches one source: silent, jumping, unreadable. Each episode gives one clear sentence, and one when it is over."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from station.angles.reading import Reading, turn_between
from station.angles.settings import SourceSettings

INFO, WARNING = 2, 3
_CALM_NS = 5_000_000_000
"""An episode of jumps or of unreadable data is over when nothing of it came for so long."""


@dataclass(frozen=True, slots=True)
class Note:
    """One line for the log; `level` as in foxglove.Log."""

    level: int
    text: str


@dataclass(slots=True)
class _Episode:
    count: int = 0
    last_ns: int = 0


class Watch:
    """The watch over one source, which refuses no reading; times are the station's clock in nanoseconds."""

    def __init__(self, name: str, *, settings: SourceSettings, silent_s: float) -> None:
        self._name, self._settings, self._silent_ns = name, settings, round(silent_s * 1e9)
        self._heard_ns: int | None = None
        self._last: Reading | None = None
        self._jumps, self._garbage = _Episode(), _Episode()
        self.silent = False
        """True if the source has said nothing for longer than it may."""

    def opened(self, now_ns: int) -> None:
        """The source was opened (again): unless it is known to be silent, it has its time to speak from now on."""
        if not self.silent:
            self._heard_ns = now_ns

    def take(self, readings: Sequence[Reading], *, now_ns: int) -> list[Note]:
        """Returns the sentences about new readings."""
        notes: list[Note] = []
        if readings and self.silent:
            silent_s = (now_ns - (self._heard_ns or now_ns)) * 1e-9
            notes.append(Note(INFO, f"The angle source {self._name} speaks again after {silent_s:.1f} s."))
        if readings:
            self._heard_ns, self.silent = now_ns, False
        for reading in readings:
            if reading.absent:
                continue
            notes.extend(self._jump_notes(reading, now_ns))
            self._last = reading
        return notes

    def _jump_notes(self, reading: Reading, now_ns: int) -> list[Note]:
        if self._last is None or self._silent_ns == 0:
            return []
        seconds = max(0.0, (reading.stamp_ns - self._last.stamp_ns) * 1e-9)
        allowed = math.radians(self._settings.jump_deg + self._settings.max_rate_deg_s * seconds)
        if turn_between(self._last, reading) <= allowed:
            return []
        before, after = math.degrees(self._last.angle_rad), math.degrees(reading.angle_rad)
        return self._say_once(
            self._jumps,
            f"The angle source {self._name} jumped from {before:.2f} to {after:.2f} degrees within {seconds:.3f} s: "
            "check that it is fixed to the plate; its readings are recorded as they come.",
            now_ns,
        )

    def unreadable(self, what: str, *, now_ns: int) -> list[Note]:
        """Notes, once for each time that this happens, that something came that is no reading."""
        return self._say_once(self._garbage, f"The angle source {self._name} gave no reading: {what}.", now_ns)

    def _say_once(self, episode: _Episode, text: str, now_ns: int) -> list[Note]:
        episode.count, episode.last_ns = episode.count + 1, now_ns
        return [Note(WARNING, text)] if episode.count == 1 else []

    def look(self, now_ns: int) -> list[Note]:
        """Returns the sentences that are due because time has passed."""
        notes = [
            *self._end(self._jumps, "jumped", now_ns),
            *self._end(self._garbage, "gave no reading", now_ns),
        ]
        heard_ns = now_ns if self._heard_ns is None else self._heard_ns
        if self._silent_ns > 0 and not self.silent and now_ns - heard_ns > self._silent_ns:
            self.silent = True
            seconds = self._silent_ns * 1e-9
            text = f"The angle source {self._name} has said nothing for {seconds:.1f} s: check its power and its cable."
            notes.append(Note(WARNING, text))
        return notes

    def _end(self, episode: _Episode, what: str, now_ns: int) -> list[Note]:
        if not episode.count or now_ns - episode.last_ns < _CALM_NS:
            return []
        count, episode.count = episode.count, 0
        return [Note(INFO, f"The angle source {self._name} {what} {count} times in all; it has been well since.")]

"""Keeps one source going: opens it, reads it, opens it again after a fault, and lets nothing of it reach the others."""

from __future__ import annotations

import math
import queue
from dataclasses import dataclass, replace

from shared.bus import Bus
from shared.clock import Clock
from shared.config import Table
from shared.errors import UserError
from shared.rig import ID_WORDS, is_id
from station.angles.reading import Reading
from station.angles.settings import SILENT_S, SourceSettings, split_table
from station.angles.sources import AngleSource, SourceLink, load_kind
from station.angles.watch import INFO, WARNING, Note, Watch


@dataclass(frozen=True, slots=True)
class Batch:
    """The result of one look at a source."""

    source: str
    readings: tuple[Reading, ...] = ()
    notes: tuple[Note, ...] = ()


class Runner:
    """One source of the rig. `step` does what is due; where it is called from decides about threads."""

    def __init__(
        self,
        name: str,
        source: AngleSource,
        *,
        settings: SourceSettings,
        silent_s: float,
        clock: Clock,
        complaints: queue.SimpleQueue[str],
    ) -> None:
        self.name = name
        self._source, self._settings, self._clock = source, settings, clock
        self._complaints = complaints
        self._watch = Watch(name, settings=settings, silent_s=silent_s)
        self._open = False
        self._retry_ns = 0
        self._fault = ""

    def step(self) -> Batch:
        """Opens the source if it is due, takes what it has, and says what is wrong with it."""
        notes: list[Note] = []
        readings = self._read(notes)
        now_ns = self._clock.now_ns()
        good = tuple(reading for reading in readings if reading.finite or reading.absent)
        if len(good) < len(readings):
            self._complaints.put(f"{len(readings) - len(good)} readings are not numbers")
        if good and self._fault:
            self._fault = ""
            notes.append(Note(INFO, f"The angle source {self.name} works again."))
        notes += self._watch.take(good, now_ns=now_ns)
        for _ in range(self._complaints.qsize()):
            notes += self._watch.unreadable(self._complaints.get(), now_ns=now_ns)
        if self._open:
            notes += self._watch.look(now_ns)
        self._revive(now_ns)
        return Batch(self.name, tuple(self._with_sigma(reading) for reading in good), tuple(notes))

    def _with_sigma(self, reading: Reading) -> Reading:
        sigma = reading.sigma_rad or math.radians(self._settings.sigma_deg)
        return replace(reading, sigma_rad=sigma)

    def _read(self, notes: list[Note]) -> tuple[Reading, ...]:
        try:
            if not self._open:
                if self._clock.now_ns() < self._retry_ns:
                    return ()
                self._source.open()
                self._open = True
                self._retry_ns = self._clock.now_ns() + round(self._settings.retry_s * 1e9)
                self._watch.opened(self._clock.now_ns())
            return self._source.read()
        except Exception as error:  # whatever one sensor's library raises, the other sensors go on
            notes += self._fail(error)
            return ()

    def _fail(self, error: Exception) -> list[Note]:
        """Lets go of a faulty source until the next try; one sentence for each new fault."""
        self._shut()
        self._retry_ns = self._clock.now_ns() + round(self._settings.retry_s * 1e9)
        known, self._fault = self._fault, str(error)
        if known == self._fault:
            return []
        what = str(error) if isinstance(error, UserError) else f"{type(error).__name__}: {error}"
        text = f"The angle source {self.name} failed ({what}); it is tried again every {self._settings.retry_s:.0f} s."
        return [Note(WARNING, text)]

    def _revive(self, now_ns: int) -> None:
        """Opens a silent source anew now and then: its server may have been restarted and have forgotten us."""
        if self._watch.silent and self._open and now_ns >= self._retry_ns:
            self._shut()

    def _shut(self) -> None:
        self._open = False
        try:
            self._source.close()
        except Exception as error:  # a driver that cannot even be closed is dropped as it is
            self._fault = str(error)

    def close(self) -> None:
        """Lets go of the source."""
        self._shut()


def runner_of_table(name: str, table: Table, *, bus: Bus, clock: Clock) -> Runner:
    """Returns the runner for `[angles.<name>]`.

    Raises:
        UserError: naming file, line and key of what is wrong in the table.
    """
    if not is_id(name):
        raise UserError(f"{table.file}: expected a name of {ID_WORDS} in [angles.…], got {name!r}")
    settings, options = split_table(table)
    module = load_kind(settings.kind or name)
    complaints: queue.SimpleQueue[str] = queue.SimpleQueue()
    link = SourceLink(name=name, bus=bus, clock=clock, options=options, complain=complaints.put)
    silent_s = settings.silent_s if settings.silent_s >= 0 else 0.0 if module.ON_DEMAND else SILENT_S
    return Runner(name, module.connect(link), settings=settings, silent_s=silent_s, clock=clock, complaints=complaints)

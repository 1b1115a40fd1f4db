"""All angle sources of a rig together: each is read on a thread of its own, and all are published on the bus.

Without threads (`threaded=False`) every `tick` reads every source: simulated time has no other way.
"""

from __future__ import annotations

import queue
import threading

from shared.bus import Bus
from shared.clock import Clock
from shared.config import Table
from shared.errors import UserError
from shared.foxglove import Log, Timestamp
from shared.topics import ANGLE_PREFIX
from station.angles.reading import message_of_reading
from station.angles.runner import Batch, Runner, runner_of_table
from station.angles.settings import SourceName, split_table
from station.angles.sources import load_kind
from station.angles.watch import Note

_PERIOD_S = 0.005


def source_names(table: Table) -> tuple[SourceName, ...]:
    """Returns the sources in the `[angles]` table of a rig; raises UserError when a kind does not exist."""
    return tuple(_source_name(name, table.child(name)) for name in table.values)


def _source_name(name: str, table: Table) -> SourceName:
    kind = split_table(table)[0].kind or name
    return SourceName(name, kind, load_kind(kind).ON_DEMAND)


class Instruments:
    """The rig's angle sources. Build it before the bus is polled, `tick` it often, `close` it at the end."""

    def __init__(self, bus: Bus, table: Table, *, clock: Clock, threaded: bool = True) -> None:
        """Raises UserError when a table is wrong or there is none."""
        if not table.values:
            raise UserError(
                f"{table.file}: expected at least one angle source, got none: add a table such as [angles.kinematics]"
            )
        self._bus, self._clock = bus, clock
        self._runners = [runner_of_table(name, table.child(name), bus=bus, clock=clock) for name in table.values]
        self._batches: queue.SimpleQueue[Batch] = queue.SimpleQueue()
        self._stop = threading.Event()
        self._threads = [self._thread(runner) for runner in self._runners] if threaded else []

    def _thread(self, runner: Runner) -> threading.Thread:
        thread = threading.Thread(target=self._run, args=(runner,), name=runner.name, daemon=True)
        thread.start()
        return thread

    @property
    def names(self) -> tuple[str, ...]:
        """The sources' names, in the order of the rig file."""
        return tuple(runner.name for runner in self._runners)

    def _run(self, runner: Runner) -> None:
        while not self._stop.is_set():
            self._batches.put(runner.step())
            self._stop.wait(_PERIOD_S)

    def tick(self) -> tuple[Note, ...]:
        """Publishes what has been read since the last call; returns what was said about the sources (also logged)."""
        if not self._threads:
            for runner in self._runners:
                self._batches.put(runner.step())
        return self._publish_all()

    def _publish_all(self) -> tuple[Note, ...]:
        batches = [self._batches.get() for _ in range(self._batches.qsize())]
        return tuple(note for batch in batches for note in self._publish(batch))

    def _publish(self, batch: Batch) -> tuple[Note, ...]:
        for reading in batch.readings:
            self._bus.publish(ANGLE_PREFIX + batch.source, message_of_reading(reading, source=batch.source))
        for note in batch.notes:
            stamp = Timestamp.from_ns(self._clock.now_ns())
            self._bus.publish("log", Log(timestamp=stamp, level=note.level, message=note.text, name="angles"))
        return batch.notes

    def close(self) -> None:
        """Stops reading, publishes what was read last, and lets go of all sources."""
        self._stop.set()
        for thread in self._threads:
            thread.join(timeout=10.0)
        self._publish_all()
        for runner in self._runners:
            runner.close()

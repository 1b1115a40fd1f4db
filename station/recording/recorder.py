"""Records everything on the bus: in its own thread, or within the call of a simulated session."""

from __future__ import annotations

import queue
import threading
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from shared import foxglove, topics
from shared.bus import Bus, Missed, Received
from shared.clock import Clock
from station.recording.writer import Recording

CAPACITY = 20_000
"""Messages that may wait: a minute of a session at its usual 330 messages a second."""
_IMAGE_SHARE = 0.05
"""Images give way first: they may fill this share of the queue, and are two thousand times as large."""
_TICK_S = 0.05
_REPORT_EVERY_NS = 1_000_000_000
_UNRECORDED = frozenset(name for name, line in topics.TOPICS.items() if not line.recorded)


@dataclass(frozen=True, kw_only=True)
class Counts:
    """Messages by topic: recorded, dropped (queue full), missed (lost on the bus), duplicates (sent twice).

    `malformed` are payloads that were no message of their topic. The bus hands these and duplicates to nobody, so that
    a recording has what its session heard.
    """

    recorded: dict[str, int]
    dropped: dict[str, int]
    missed: dict[str, int]
    duplicates: dict[str, int]
    malformed: dict[str, int]

    def metadata(self) -> dict[str, str]:
        """Returns the metadata record `recorder`: a total and a line for each topic that lost something."""
        values = {"recorded": str(sum(self.recorded.values()))}
        for what in ("dropped", "missed", "duplicates", "malformed"):
            counts: dict[str, int] = getattr(self, what)
            values[what] = str(sum(counts.values()))
            values.update({f"{what} {topic}": str(count) for topic, count in sorted(counts.items())})
        return values


class Sink(Protocol):
    """A taker of messages one by one: a `Recording`, or one that is written by another process."""

    stopped: str

    def write(self, received: Received) -> None:
        """Records one message as it came."""
        ...


def record_within(bus: Bus, recording: Sink) -> None:
    """Records every message of a bus within the call that publishes it, for simulated time: nothing is dropped."""

    def write(received: Received) -> None:
        if received.topic not in _UNRECORDED:
            recording.write(received)

    bus.subscribe("**", write, direct=True)


class Recorder:
    """A thread that records a live bus. It starts at once; `close` ends it and the recording.

    The bus's receiving threads only enqueue. `on_stopped` is told, on the recorder's thread, when the recording had to
    stop (disk full): end the session safely then.
    """

    def __init__(
        self,
        bus: Bus,
        recording: Recording,
        *,
        clock: Clock,
        capacity: int = CAPACITY,
        on_stopped: Callable[[str], None] | None = None,
    ) -> None:
        self._bus, self._recording = bus, recording
        self._clock = clock
        self._capacity = capacity
        self._image_capacity = max(1, int(capacity * _IMAGE_SHARE))
        self._on_stopped = on_stopped
        self._queue: queue.SimpleQueue[Received | Missed | None] = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._dropped: Counter[str] = Counter()
        self._missed: Counter[str] = Counter()
        self._recorded: Counter[str] = Counter()
        self._reported: Counter[tuple[str, str]] = Counter()
        self._report_after_ns = 0
        self._closing = False
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()
        self._subscribe(bus)

    def _subscribe(self, bus: Bus) -> None:
        for name, line in topics.TOPICS.items():
            if not line.recorded:
                continue
            bus.subscribe(name, self._take, direct=True, on_miss=self._take_miss)
        # Angle sources and topics that a newer agent may send have no line in the table, hence no recovery.
        bus.subscribe("**", self._take_unlisted, direct=True)

    # --- on the bus's threads ----------------------------------------------------------------------------------------

    def _take(self, received: Received) -> None:
        if self._closing:
            return
        waiting = self._queue.qsize()
        if waiting >= self._capacity or (waiting >= self._image_capacity and received.topic == "camera/image"):
            with self._lock:
                self._dropped[received.topic] += 1
            return
        self._queue.put(received)

    def _take_unlisted(self, received: Received) -> None:
        if received.topic not in topics.TOPICS:
            self._take(received)

    def _take_miss(self, missed: Missed) -> None:
        if not self._closing:
            self._queue.put(missed)

    # --- on the recorder's thread ------------------------------------------------------------------------------------

    def _run(self) -> None:
        try:
            self._record_all()
        except Exception as error:
            # Whatever goes wrong here must end the session, not only this thread: a measurement without a record.
            self._closing = True
            self._tell(f"The recorder failed ({type(error).__name__}: {error}); end the session and report this")
            raise

    def _record_all(self) -> None:
        while True:
            try:
                item = self._queue.get(timeout=_TICK_S)
            except queue.Empty:
                self._tick()
                continue
            if item is None:
                return
            if isinstance(item, Missed):
                self._record_miss(item)
            else:
                self._record(item)
            self._tick()

    def _record(self, received: Received) -> None:
        if self._recording.stopped:
            with self._lock:
                self._dropped[received.topic] += 1
            return
        self._recording.write(received)
        self._recorded[received.topic] += 1

    def _record_miss(self, missed: Missed) -> None:
        self._missed[missed.topic] += missed.count
        self._log(f"{missed.count} messages of {missed.topic} were lost on the bus and could not be recovered")

    def _tick(self) -> None:
        now_ns = self._clock.now_ns()
        self._recording.flush_if_due(now_ns)
        if now_ns >= self._report_after_ns:
            self._report_after_ns = now_ns + _REPORT_EVERY_NS
            self._report_losses()
        if self._recording.stopped:
            self._tell(self._recording.stopped)

    def _tell(self, sentence: str) -> None:
        if self._on_stopped is not None:
            tell, self._on_stopped = self._on_stopped, None
            tell(sentence)

    def _report_losses(self) -> None:
        full = f"were dropped: the recorder's queue of {self._capacity} was full"
        with self._lock:
            now = Counter({(topic, full): count for topic, count in self._dropped.items()})
        now.update({(topic, "were malformed and left out"): count for topic, count in self._bus.malformed.items()})
        new, self._reported = now - self._reported, now
        for (topic, fate), count in sorted(new.items()):
            self._log(f"{count} messages of {topic} {fate}")

    def _log(self, sentence: str) -> None:
        now_ns = self._clock.now_ns()
        line = foxglove.Log(
            timestamp=foxglove.Timestamp.from_ns(now_ns),
            level=foxglove.LEVELS["warning"],
            message=sentence,
            name="recorder",
        )
        self._recording.write_message("log", line, receive_ns=now_ns)

    # --- for the session ---------------------------------------------------------------------------------------------

    @property
    def counts(self) -> Counts:
        """The counts of what was recorded and what was not, so far."""
        with self._lock:
            dropped = dict(self._dropped)
        return Counts(
            recorded=dict(self._recorded),
            dropped=dropped,
            missed=dict(self._missed),
            duplicates=dict(self._bus.duplicates),
            malformed=dict(self._bus.malformed),
        )

    def close(self) -> Counts:
        """Records what still waits, finishes the file, and says what was recorded. Call it before the bus is closed.

        `on_stopped` is told, on this thread, if the file could not be finished.
        """
        self._closing = True
        if self._thread.is_alive():
            self._queue.put(None)
            self._thread.join()
            self._report_losses()
            if not self._recording.stopped:
                self._recording.add_metadata("recorder", self.counts.metadata())
        self._recording.close()
        if self._recording.stopped:
            self._tell(self._recording.stopped)
        return self.counts

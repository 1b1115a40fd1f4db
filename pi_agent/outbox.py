"""A thread between the camera and the bus: a stuck link must not keep the next frame waiting."""

from __future__ import annotations

import queue
import threading

from shared.bus import Bus
from shared.messages import Message

LONGEST = 2700
"""Messages that wait at most: 30 s at 90 Hz, as long as the bus's own memory."""


class Outbox:
    """Publishes what it is given, in order."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._waiting: queue.Queue[tuple[str, Message]] = queue.Queue(LONGEST)
        self.lost = 0
        """Messages that were thrown away because too many waited, or because the bus refused them."""

    def put(self, topic: str, message: Message) -> None:
        """Queues a message; never waits."""
        try:
            self._waiting.put_nowait((topic, message))
        except queue.Full:
            self.lost += 1

    def __len__(self) -> int:
        """Returns the number of messages that wait."""
        return self._waiting.qsize()

    def run(self, stop: threading.Event) -> None:
        """Publishes until `stop` is set and nothing waits any more."""
        while not (stop.is_set() and self._waiting.empty()):
            try:
                topic, message = self._waiting.get(timeout=0.1)
            except queue.Empty:
                continue
            try:
                self._bus.publish(topic, message)
            except Exception:
                # One message that the bus refuses must not silence all that come after it.
                self.lost += 1

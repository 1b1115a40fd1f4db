"""Sends on a thread of its own what may have to wait, so that nobody who has something to say waits for the network.

A link that is cut keeps its sender waiting until it is given up: the arm agent, with its safety gate, would stand still
for seconds (`make faults ARGS="--row 'cable cut'"`).
"""

from __future__ import annotations

import logging
import queue
import threading
from collections.abc import Callable

_LOG = logging.getLogger(__name__)


class Outbox:
    """Jobs that are done one after another, in the order in which they came. Close it."""

    def __init__(self) -> None:
        """Starts the thread."""
        # It cannot grow without limit: a link that takes nothing is given up within seconds.
        self._jobs: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._work, name="outbox", daemon=True)
        self._thread.start()

    def put(self, job: Callable[[], None]) -> None:
        """Takes a job and returns at once; it may be called on any thread."""
        self._jobs.put(job)

    def close(self, *, within_s: float) -> None:
        """Waits, but no longer than that, until everything that was put is done."""
        self._jobs.put(None)
        self._thread.join(within_s)

    def _work(self) -> None:
        while (job := self._jobs.get()) is not None:
            try:
                job()
            except Exception:  # one job that fails must not keep the others from being done
                _LOG.exception("A message could not be sent")

"""Tells of a session on a thread of its own, so that a receiver that hangs, refuses or fails delays nobody."""

from __future__ import annotations

import json
import queue
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

from shared.notify import Kind, NotifyConfig
from shared.visible import sentence
from station.app.notify.deliver import UndeliveredError, call, post

CAPACITY = 20
"""Notifications that may wait: a session has a handful, and what is older than these helps nobody."""
_HANGING = 3
"""Deliveries that may hang beyond their time limit at once, each on a thread that cannot be ended."""
_GRACE_S = 1.0


@dataclass(frozen=True)
class Notification:
    """One notification: its kind, a sentence, the time (ns since 1970), and further facts by name."""

    kind: str
    text: str
    time_ns: int
    facts: dict[str, Any] = field(default_factory=dict[str, Any])

    def body(self) -> bytes:
        """Returns the JSON that is sent."""
        time = datetime.fromtimestamp(self.time_ns * 1e-9, tz=UTC).isoformat(timespec="seconds")
        return json.dumps({"event": self.kind, "text": self.text, "time": time, **self.facts}).encode()


class Notifier:
    """Takes notifications and delivers them one after another. Close it."""

    def __init__(self, config: NotifyConfig, *, seconds: Callable[[], float]) -> None:
        """`seconds` is a clock for the least time between two notifications of a kind."""
        self._config, self._seconds = config, seconds
        self._jobs: queue.Queue[Notification | None] = queue.Queue(CAPACITY)
        self._failures: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._notified_s: dict[str, float] = {}
        self._held_back: Counter[str] = Counter()
        self._hanging: list[threading.Thread] = []
        self._thread = threading.Thread(target=self._work, name="notify", daemon=True)
        if config.anybody:
            self._thread.start()

    def tell(self, kind: Kind, text: str, *, time_ns: int, wanted: bool | None = None, **facts: Any) -> None:
        """Takes a notification and returns at once; on any thread.

        It is sent if its kind is, or `wanted` says so, and if none of its kind was within `quiet_s`.
        """
        if not self._config.anybody or not (kind in self._config.on if wanted is None else wanted):
            return
        now_s = self._seconds()
        if (
            kind in self._notified_s
            and now_s - self._notified_s[kind] < self._config.quiet_s
            and kind not in ("end", "disk")
        ):
            self._held_back[kind] += 1
            return
        self._notified_s[kind] = now_s
        more = self._held_back.pop(kind, 0)
        said = sentence(text) + (f" ({more} more of this kind since the last one)" if more else "")
        try:
            self._jobs.put_nowait(Notification(kind, said, time_ns, facts))
        except queue.Full:
            self._failures.put(f"nobody was told of '{kind}': {CAPACITY} notifications wait already")

    def failures(self) -> Iterator[str]:
        """Yields the failures since this was last asked, a sentence each."""
        while not self._failures.empty():
            yield self._failures.get()

    def close(self) -> None:
        """Waits, no longer than the time limit of a receiver, until everything is sent."""
        if not self._config.anybody:
            return
        try:
            self._jobs.put_nowait(None)
        except queue.Full:
            self._failures.put(f"{CAPACITY} notifications were not sent: their receiver hangs")
            return
        receivers = bool(self._config.url) + bool(self._config.command)
        within_s = receivers * (self._config.timeout_s + _GRACE_S)
        self._thread.join(within_s)
        if self._thread.is_alive():
            self._failures.put(f"not everything was sent within {within_s:g} s: the receiver of [notify] hangs")

    def _work(self) -> None:
        while (one := self._jobs.get()) is not None:
            for deliver in self._receivers(one):
                if failure := self._within_limit(deliver):
                    self._failures.put(f"nobody was told of '{one.kind}' through [notify]: {failure}")

    def _receivers(self, one: Notification) -> Iterator[Callable[[], None]]:
        config, body = self._config, one.body()
        if config.url:
            yield lambda: post(config.url, body, timeout_s=config.timeout_s)
        if config.command:
            yield lambda: call(config.command, one.text, body, timeout_s=config.timeout_s)

    def _within_limit(self, deliver: Callable[[], None]) -> str:
        """Delivers, and leaves a delivery that hangs to itself; gives the failure, or nothing.

        A library's time limit is for each byte: a receiver that drips, or a name server that is silent, knows no end.
        """
        self._hanging = [thread for thread in self._hanging if thread.is_alive()]
        if len(self._hanging) >= _HANGING:
            return f"{_HANGING} earlier deliveries still hang"
        failures: list[str] = []
        thread = threading.Thread(target=_deliver, args=(deliver, failures), name="notification", daemon=True)
        thread.start()
        thread.join(self._config.timeout_s + _GRACE_S)
        if thread.is_alive():
            self._hanging.append(thread)
            return f"its receiver did not answer within {self._config.timeout_s:g} s"
        return "; ".join(failures)


def _deliver(deliver: Callable[[], None], failures: list[str]) -> None:
    try:
        deliver()
    except UndeliveredError as error:
        failures.append(str(error))
    except Exception as error:  # whatever it is, it must neither end the thread's caller nor show the URL
        failures.append(f"an unexpected {type(error).__name__}")

"""The interface of the bus to a process.

Handlers run on the thread that calls `poll`, in order of arrival, so a process needs no locks. Only the recorder takes
messages on the receiving thread (`direct=True`), and there it may do nothing but enqueue.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from shared import topics, wire
from shared.errors import UserError
from shared.frozen import quicken
from shared.messages import Message


@dataclass(frozen=True, slots=True)
class Recipe:
    """A message that is made when somebody looks at it: `make(**values)`.

    `make` is a function of a module, and the values are messages, numbers, texts or None, so that another process, the
    one that writes a recording, can make it as well.
    """

    make: Callable[..., Message]
    values: Mapping[str, Any]

    def made(self) -> Message:
        """Returns the message."""
        return self.make(**self.values)


quicken(Recipe)


class Received:
    """A message as it arrived: `message`, `payload` (the bytes as they were sent) or both are given, or a recipe.

    What is not given is derived when it is first asked for; that raises UserError when a payload does not parse. A bus
    hands out nothing that does not parse, but for topics that this version does not know.
    """

    __slots__ = ("message", "payload", "receive_ns", "recipe", "topic")
    message: Message
    payload: bytes

    def __init__(
        self,
        topic: str,
        receive_ns: int,
        message: Message | None = None,
        *,
        payload: bytes | None = None,
        recipe: Recipe | None = None,
    ) -> None:
        self.topic = topic
        self.receive_ns = receive_ns
        self.recipe = recipe
        if message is not None:
            self.message = message
        if payload is not None:
            self.payload = payload

    def __getattr__(self, name: str) -> Message | bytes:
        """Derives a field that was not given; Python asks here only while the slot is empty."""
        if name == "payload":
            self.payload = wire.encode(self.message)
            return self.payload
        if name != "message":
            raise AttributeError(name)
        if self.recipe is not None:
            self.message = self.recipe.made()
        else:
            self.message = wire.decode(topics.topic(self.topic).message, self.payload)
        return self.message


@dataclass(frozen=True, slots=True)
class Missed:
    """Messages of a recovered topic that could not be recovered."""

    topic: str
    count: int
    receive_ns: int


Handler = Callable[[Received], None]
MissHandler = Callable[[Missed], None]
Server = Callable[[Message], Message]
ReplyHandler = Callable[[Message | None], None]
"""A function that gets the reply, or None when nobody answered in time."""


class Bus(Protocol):
    """The bus of one rig as one process sees it."""

    malformed: Counter[str]
    """The number of payloads, by topic or service, that were no message of it: they were dropped and reached nobody."""
    duplicates: Counter[str]
    """The number of messages, by recovered topic, that came a second time and reached nobody again."""

    def leave_out(self, name: str, error: UserError) -> None:
        """Counts a message as `malformed` of which its handler alone can tell that it is none; the log says why."""
        ...

    def publish(self, topic: str, message: Message | Recipe) -> None:
        """Sends a message to all subscribers; the topic's traffic class decides how."""
        ...

    def carries(self, topic: str) -> bool:
        """Returns true if a message of that topic may reach anybody; otherwise it need not be made."""
        ...

    def subscribe(
        self, topic: str, handler: Handler, *, direct: bool = False, on_miss: MissHandler | None = None
    ) -> None:
        """Calls `handler` for every message of a topic; `**` means every topic (no recovery of lost ones then)."""
        ...

    def serve(self, service: str, server: Server, *, direct: bool = False) -> None:
        """Answers a service; `direct` answers on the receiving thread (clock pings want that)."""
        ...

    def request(
        self, service: str, message: Message, on_reply: ReplyHandler, *, timeout_s: float = 1.0, direct: bool = False
    ) -> None:
        """Asks a service; the answer comes to `on_reply` during a later `poll`, or at once with `direct`."""
        ...

    def announce(self, name: str) -> None:
        """Declares that the process `name` is alive, until the bus is closed or the process dies."""
        ...

    def alive(self) -> frozenset[str]:
        """Returns the names of the processes that are alive."""
        ...

    def poll(self, timeout_s: float = 0.0) -> int:
        """Runs the handlers of what has arrived, waiting up to `timeout_s` for the first; returns their number."""
        ...

    def close(self) -> None:
        """Leaves the bus. Never called from a handler."""
        ...

"""The bus within one process: messages are passed as objects, at once, in simulated time."""

from __future__ import annotations

import logging
from collections import Counter, defaultdict

from shared import topics
from shared.bus import Handler, MissHandler, Received, Recipe, ReplyHandler, Server
from shared.clock import Clock
from shared.errors import UserError
from shared.messages import Message

_LOG = logging.getLogger(__name__)


class MemoryBus:
    """A `Bus` without a network. `publish` calls the handlers itself, so `poll` has nothing to do.

    Messages of topics that are `left_out` reach nobody.
    """

    def __init__(self, clock: Clock, *, left_out: frozenset[str] = frozenset()) -> None:
        self._clock, self._left_out = clock, left_out
        self._last_receive_ns = 0
        self.malformed: Counter[str] = Counter()
        """Messages that a handler left out: they are passed as objects, and there is nothing to parse."""
        self.duplicates: Counter[str] = Counter()
        """None: nothing is sent twice here."""
        self._handlers: dict[str, list[Handler]] = defaultdict(list)
        self._routes: dict[str, tuple[Handler, ...]] = {}
        self._servers: dict[str, Server] = {}
        self._alive: set[str] = set()

    def leave_out(self, name: str, error: UserError) -> None:
        """Counts the message, and logs why."""
        self.malformed[name] += 1
        _LOG.warning("Left out a malformed message on %s: %s", name, error)

    def publish(self, topic: str, message: Message | Recipe) -> None:
        """Hands the message to every subscriber before it returns; a recipe is made by whoever looks at it."""
        route = self._routes.get(topic) or self._route(topic)
        if not route:
            return
        now_ns, last_ns = self._clock.now_ns(), self._last_receive_ns
        # Later than the message before: no two messages share a time of receipt.
        self._last_receive_ns = receive_ns = now_ns if now_ns > last_ns else last_ns + 1
        if isinstance(message, Recipe):
            received = Received(topic, receive_ns, recipe=message)
        else:
            received = Received(
                topic, receive_ns, message
            )  # fields are given by position: it is made hundreds of times a second
        for handler in route:
            handler(received)

    def _route(self, topic: str) -> tuple[Handler, ...]:
        # Recorders of everything first: a recording then holds the order of arrival.
        route = () if topic in self._left_out else (*self._handlers["**"], *self._handlers[topic])
        self._routes[topic] = route
        return route

    def carries(self, topic: str) -> bool:
        """Returns true if anybody subscribes to that topic."""
        return bool(self._routes.get(topic) or self._route(topic))

    def subscribe(
        self, topic: str, handler: Handler, *, direct: bool = False, on_miss: MissHandler | None = None
    ) -> None:
        """Calls `handler` from within `publish`; nothing is ever missed here."""
        del direct, on_miss
        if topic != "**":
            topics.topic(topic)
        self._handlers[topic].append(handler)
        self._routes.clear()

    def serve(self, service: str, server: Server, *, direct: bool = False) -> None:
        """Answers a service from within `request`."""
        del direct
        self._servers[topics.SERVICES[service].name] = server

    def request(
        self, service: str, message: Message, on_reply: ReplyHandler, *, timeout_s: float = 1.0, direct: bool = False
    ) -> None:
        """Asks a service; `on_reply` gets the answer, or None if nobody serves, before this returns."""
        del timeout_s, direct
        server = self._servers.get(topics.SERVICES[service].name)
        on_reply(server(message) if server else None)

    def announce(self, name: str) -> None:
        """Counts the process `name` as alive from now on."""
        self._alive.add(name)

    def alive(self) -> frozenset[str]:
        """Returns the names of all processes that were announced."""
        return frozenset(self._alive)

    def poll(self, timeout_s: float = 0.0) -> int:
        """Returns 0: nothing waits here."""
        del timeout_s
        return 0

    def close(self) -> None:
        """Removes all subscribers and services."""
        self._handlers.clear()
        self._routes.clear()
        self._servers.clear()

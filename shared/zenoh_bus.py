"""The bus over Zenoh: the only module that knows the library.

Every process listens on its own explicit endpoint and connects to the others'; multicast and gossip are off, so two
rigs on one network never take each other's commands. No process forwards for others: who reaches the camera agent's
port reaches the camera agent alone, whichever mode of Zenoh's he comes in. Corners and events go through Zenoh's
advanced publisher and subscriber (cache, heartbeat, recovery): a cut link or a restarted station loses none of them.
Zenoh's callbacks only enqueue; `poll` runs the handlers on the caller's thread, which never waits for a link.
"""

from __future__ import annotations

import contextlib
import functools
import json
import logging
import os
import queue
import re
import threading
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import zenoh
from zenoh import ext

from shared import topics, wire
from shared.bus import Handler, Missed, MissHandler, Received, Recipe, ReplyHandler, Server
from shared.bus_keys import RIGHTS, keys_in_use, members_in, tls_settings
from shared.bus_rights import OBSERVER
from shared.bus_watch import BusWatch
from shared.clock import Clock, SystemClock
from shared.errors import UserError
from shared.messages import Message
from shared.outbox import Outbox
from shared.repeats import Repeats
from shared.rig import RigConfig
from shared.visible import sentence

_LOG = logging.getLogger(__name__)
_ALIVE = "@alive"
_LEASE_MS = 1000
_CLOSING_S = 6.0
"""A little longer than Zenoh waits for a link that takes nothing before it gives it up (5 s)."""
_RECEIVERS = 8
"""Zenoh's threads that receive, for all links together. It closes a dead link on one of them, which waits for up to ten
seconds (SO_LINGER) for what the link has not taken. Of the two that it has by itself two dead links take both, and the
arm agent hears nothing from anybody, its joints included. A rig has at most six processes that it is linked with.
`make faults ARGS="--row 'cable cut'"` shows it."""
_PRIORITIES = (
    zenoh.Priority.REAL_TIME,
    zenoh.Priority.INTERACTIVE_HIGH,
    zenoh.Priority.INTERACTIVE_LOW,
    zenoh.Priority.DATA_HIGH,
    zenoh.Priority.DATA,
    zenoh.Priority.DATA_LOW,
    zenoh.Priority.BACKGROUND,
)


def _addressed(name: str, carrier: Any) -> None:
    """Checks what a sample or query is addressed to against the `name` in its key.

    Zenoh sends a number for a key. When a link is lost and made again while the machine hardly runs, the first few
    messages may be given out under a number of the old link, and so under another key: an image came as `arm/command`,
    where it parsed. Each message of ours therefore carries its name beside its key; other people's programs need not.

    Raises:
        UserError: if it is addressed to another topic or service.
    """
    meant = carrier.attachment.to_bytes().decode(errors="replace") if carrier.attachment else name
    if meant != name:
        raise UserError(f"Expected a message of {name}, got one of {meant[:80]} under its key, as after a lost link")


def _why(error: Exception) -> str:
    """Returns Zenoh's error message without the places in its source."""
    return re.sub(r" at /\S+\.rs:\d+\.?", "", str(error))


def _config(listen: Sequence[str], connect: Sequence[str], *, rig_id: str, process: str) -> zenoh.Config:
    settings: dict[str, Any] = {
        "mode": "peer",
        "listen/endpoints": list(listen),
        "connect/endpoints": list(connect),
        # A missing peer is retried in the background for ever (0 would mean one attempt); it never keeps a process
        # from starting.
        "connect/timeout_ms": -1,
        "connect/exit_on_failure": False,
        "connect/retry": {"period_init_ms": 200, "period_max_ms": 1000, "period_increase_factor": 2},
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        # Nobody lies "south" of a process, so none forwards from one session to another: a client, which has no other
        # way to the rest of the network, is turned away, and a peer meets the process that it reached and no other.
        "gateway": {"south": []},
        "timestamping/enabled": True,
        "transport/link/tx/lease": _LEASE_MS,
        **tls_settings([*listen, *connect], rig_id=rig_id, process=process),
    }
    config = zenoh.Config()
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return config


class ZenohBus:
    """A `Bus` for one rig. Close it, or use it as a context manager: otherwise the process hangs at its end."""

    def __init__(
        self,
        rig_id: str,
        *,
        listen: Sequence[str] = (),
        connect: Sequence[str] = (),
        clock: Clock | None = None,
        process: str = OBSERVER,
    ) -> None:
        """Opens the session of a process, whose keys are used where endpoints are encrypted.

        Raises:
            UserError: if the rig has no id or an endpoint cannot be listened on.
        """
        if not rig_id or "/" in rig_id or "*" in rig_id:
            raise UserError(f"Expected a rig id without '/' and '*' in the rig file (id = \"…\"), got '{rig_id}'")
        self._prefix = f"repose/{rig_id}"
        self._clock = clock or SystemClock()
        # Not a SimpleQueue: a signal that comes just as its `get` times out lets it wait for ever (CPython to 3.11).
        self._inbox: queue.Queue[Callable[[], None]] = queue.Queue()
        self._publishers: dict[str, Any] = {}
        self._entities: list[Any] = []
        self._alive: dict[str, int] = {}
        self._taken: list[Callable[[], None]] = []
        self._handlers: dict[str, list[tuple[Handler, bool]]] = {}
        self._arrival = threading.Lock()
        self._last_receive_ns = 0
        self._recovering: dict[str, Any] = {}
        self.malformed: Counter[str] = Counter()
        """Messages by topic or service that did not parse or were another's, and were left out."""
        self.duplicates: Counter[str] = Counter()
        """Messages by topic that a cache gave a second time."""
        os.environ.setdefault("ZENOH_RUNTIME", f"(rx: (worker_threads: {_RECEIVERS}))")  # no entry of the configuration
        zenoh.try_init_log_from_env()  # silent without RUST_LOG
        try:
            self._session = zenoh.open(_config(listen, connect, rig_id=rig_id, process=process))
        except zenoh.ZError as error:
            raise UserError(
                f"Expected to listen on {', '.join(listen) or 'nothing'}, but Zenoh refused ({_why(error)}); "
                "is the same process already running, or the address not this machine's?"
            ) from error
        self._outbox = Outbox()
        self._watch = self._watched(listen, connect, rig_id=rig_id, process=process)
        watcher = self._session.liveliness().declare_subscriber(
            f"{self._prefix}/{_ALIVE}/*", self._on_alive, history=True
        )
        self._entities.append(watcher)

    def _watched(self, listen: Sequence[str], connect: Sequence[str], *, rig_id: str, process: str) -> BusWatch | None:
        """Returns the watch that says who is refused; None without keys."""
        folder = keys_in_use([*listen, *connect], process=process)
        if folder is None:
            return None
        rights = folder / RIGHTS
        watch = BusWatch(folder, process, members_in(rights, rig_id) if rights.exists() else {}, tuple(connect))
        watch.read_own()

        def linked(event: zenoh.LinkEvent) -> None:
            if event.kind == zenoh.SampleKind.PUT:
                watch.linked(event.link.auth_identifier, event.link.dst)

        self._entities.append(self._session.info.declare_link_events_listener(linked, history=True))
        return watch

    @classmethod
    def of(cls, process: str, rig: RigConfig, *, clock: Clock | None = None) -> ZenohBus:
        """Returns the bus of a process of a rig, on its endpoint in `[bus]`; a process without one only looks on.

        Raises:
            UserError: as the class does.
        """
        listen, connect = rig.bus.endpoint(process), rig.bus.peers(process)
        return cls(rig.id, listen=listen, connect=connect, clock=clock, process=process)

    def __enter__(self) -> ZenohBus:
        """Returns the bus itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Closes the bus."""
        self.close()

    def _key(self, name: str) -> str:
        return f"{self._prefix}/{name}"

    def _on_alive(self, sample: zenoh.Sample) -> None:
        name = str(sample.key_expr).rsplit("/", 1)[-1]
        change = 1 if sample.kind == zenoh.SampleKind.PUT else -1
        self._alive[name] = max(self._alive.get(name, 0) + change, 0)

    # --- streams -----------------------------------------------------------------------------------------------------

    def publish(self, topic: str, message: Message | Recipe) -> None:
        """Sends at once what may be dropped; all else waits in line for the thread that sends."""
        payload = wire.encode(message.made() if isinstance(message, Recipe) else message)
        if topics.topic(topic).traffic.drop:
            self._put(topic, payload)
        else:
            self._outbox.put(functools.partial(self._put, topic, payload))

    def _put(self, topic: str, payload: bytes) -> None:
        (self._publishers.get(topic) or self._declare_publisher(topic)).put(payload, attachment=topic.encode())

    def _declare_publisher(self, name: str) -> Any:
        if self._watch is not None:
            self._watch.sending(name)
        traffic = topics.topic(name).traffic
        options: dict[str, Any] = {
            "priority": _PRIORITIES[traffic.priority - 1],
            "congestion_control": zenoh.CongestionControl.DROP if traffic.drop else zenoh.CongestionControl.BLOCK,
        }
        if traffic.cache:
            publisher = ext.declare_advanced_publisher(
                self._session,
                self._key(name),
                cache=ext.CacheConfig(traffic.cache),
                sample_miss_detection=ext.MissDetectionConfig(heartbeat=0.5, sporadic_heartbeat=None),
                publisher_detection=True,
                **options,
            )
        else:
            publisher = self._session.declare_publisher(self._key(name), **options)
        self._publishers[name] = publisher
        return publisher

    def carries(self, topic: str) -> bool:
        """Returns True: the bus does not know who listens."""
        del topic
        return True

    def subscribe(
        self, topic: str, handler: Handler, *, direct: bool = False, on_miss: MissHandler | None = None
    ) -> None:
        """Calls `handler` for every message of a topic, during `poll` or, with `direct`, on the thread that receives.

        Lost messages are fetched again if the topic has a cache.
        """
        known = self._handlers.setdefault(topic, [])
        known.append((handler, direct))
        if len(known) == 1:
            self._declare_subscriber(topic)
        if on_miss is not None and topic in self._recovering:
            callback = self._miss_receiver(topic, on_miss, direct=direct)
            self._entities.append(self._recovering[topic].sample_miss_listener(callback))

    def _declare_subscriber(self, topic: str) -> None:
        callback = self._receiver(topic)
        if topic == "**" or not topics.topic(topic).traffic.cache:
            self._entities.append(self._session.declare_subscriber(self._key(topic), callback))
            return
        subscriber = ext.declare_advanced_subscriber(
            self._session,
            self._key(topic),
            callback,
            history=ext.HistoryConfig(detect_late_publishers=True),
            recovery=ext.RecoveryConfig(heartbeat=True, periodic_queries=None),
        )
        self._recovering[topic] = subscriber
        self._entities.append(subscriber)

    def _receiver(self, topic: str) -> Callable[[zenoh.Sample], None]:
        """Returns one callback for all handlers of a topic.

        Zenoh may call from several threads. Under the lock every message gets a later stamp than the one before, and
        takes its place in every queue, so that a recording sorted by receive time is exactly what the handlers saw.
        None of them sees what a cache gives a second time.
        """
        skip, handlers = len(self._prefix) + 1, self._handlers[topic]
        cache = topics.TOPICS[topic].traffic.cache if topic in topics.TOPICS else 0
        repeats = Repeats(cache)

        def callback(sample: zenoh.Sample) -> None:
            name = str(sample.key_expr)[skip:]
            if name.startswith(_ALIVE):
                return
            payload = sample.payload.to_bytes()
            try:
                _addressed(name, sample)
                message = wire.decode(topics.topic(name).message, payload) if topics.known(name) else None
            except UserError as error:
                self.leave_out(name, error)
                return
            with self._arrival:
                if cache and sample.timestamp is not None and repeats.seen(str(sample.timestamp)):
                    self.duplicates[name] += 1
                    return
                self._last_receive_ns = max(self._clock.now_ns(), self._last_receive_ns + 1)
                received = Received(name, self._last_receive_ns, message, payload=payload)
                for handler, direct in tuple(handlers):
                    if direct:
                        handler(received)
                    else:
                        self._inbox.put(functools.partial(handler, received))

        return callback

    def leave_out(self, name: str, error: UserError) -> None:
        """Counts a payload that is no message, whoever sent it; a flood is logged sparsely."""
        with self._arrival:
            self.malformed[name] += 1
            count = self.malformed[name]
        if count.bit_count() == 1:  # 1, 2, 4, 8, …
            _LOG.warning("Left out %d malformed messages on %s; the last: %s", count, name, sentence(str(error)))

    def _miss_receiver(self, topic: str, on_miss: MissHandler, *, direct: bool) -> Callable[[ext.Miss], None]:
        def callback(miss: ext.Miss) -> None:
            missed = Missed(topic, count=miss.nb, receive_ns=self._clock.now_ns())
            if direct:
                on_miss(missed)
            else:
                self._inbox.put(lambda: on_miss(missed))

        return callback

    # --- services ----------------------------------------------------------------------------------------------------

    def serve(self, service: str, server: Server, *, direct: bool = False) -> None:
        """Answers a service with `server`, during `poll` or, with `direct`, on the thread that receives."""
        line, key = topics.SERVICES[service], self._key(service)

        def answer(query: zenoh.Query) -> None:
            payload = query.payload.to_bytes() if query.payload else b""
            try:
                _addressed(service, query)
                asked = wire.decode(line.request, payload, may_be_empty=True)
            except UserError as error:
                self.leave_out(service, error)
                query.drop()  # unanswered: a process that cannot ask would not understand either
                return
            sending = functools.partial(reply, query, wire.encode(server(asked)))
            # A direct answer is a matter of microseconds (clocks), and keeps Zenoh's own thread alone.
            sending() if direct else self._outbox.put(sending)

        def reply(query: zenoh.Query, payload: bytes) -> None:
            with query, contextlib.suppress(zenoh.ZError):  # the asker is gone
                query.reply(key, payload, attachment=service.encode())

        def callback(query: zenoh.Query) -> None:
            if direct:
                answer(query)
            else:
                self._inbox.put(lambda: answer(query))

        self._entities.append(self._session.declare_queryable(key, callback))

    def request(
        self, service: str, message: Message, on_reply: ReplyHandler, *, timeout_s: float = 1.0, direct: bool = False
    ) -> None:
        """Asks a service; `on_reply` gets the first valid answer, or None once Zenoh ends the query."""
        line = topics.SERVICES[service]
        if self._watch is not None:
            self._watch.asking(service)
        answered: list[bool] = []

        def deliver(reply: Message | None) -> None:
            if answered:
                return
            answered.append(True)
            if direct:
                on_reply(reply)
            else:
                self._inbox.put(lambda: on_reply(reply))

        def on_sample(reply: zenoh.Reply) -> None:
            if reply.ok is None:
                return
            try:
                _addressed(service, reply.ok)
                deliver(wire.decode(line.reply, reply.ok.payload.to_bytes(), may_be_empty=True))
            except UserError as error:
                self.leave_out(service, error)

        # The second callable runs when the query is over, answered or not.
        handler = zenoh.handlers.Callback(on_sample, lambda: deliver(None))
        self._session.get(
            self._key(service),
            handler,
            payload=wire.encode(message),
            attachment=service.encode(),
            timeout=timeout_s,
            priority=_PRIORITIES[line.traffic.priority - 1],
            congestion_control=zenoh.CongestionControl.BLOCK,
        )

    # --- presence ----------------------------------------------------------------------------------------------------

    def announce(self, name: str) -> None:
        """Declares a liveliness token for the process `name`, which ends with this session."""
        self._entities.append(self._session.liveliness().declare_token(f"{self._prefix}/{_ALIVE}/{name}"))

    def alive(self) -> frozenset[str]:
        """Returns the names of the processes whose liveliness tokens are known."""
        return frozenset(name for name, count in list(self._alive.items()) if count > 0)

    # --- life --------------------------------------------------------------------------------------------------------

    def poll(self, timeout_s: float = 0.0) -> int:
        """Runs the handlers of what has arrived, waiting up to `timeout_s` for the first; returns their number.

        What arrives while the handlers run waits for the next call, so this always returns.
        """
        if self._watch is not None:
            self._watch.look(alive=bool(self.alive()))
        with contextlib.suppress(queue.Empty):
            self._taken.append(self._inbox.get(timeout=timeout_s) if timeout_s > 0 else self._inbox.get_nowait())
            for _ in range(self._inbox.qsize()):
                self._taken.append(self._inbox.get_nowait())
        taken, self._taken = self._taken, []
        for run in taken:
            run()
        return len(taken)

    def close(self) -> None:
        """Leaves the bus; what was published is sent first, if the network takes it in time."""
        self._outbox.close(within_s=_CLOSING_S)
        for entity in [*self._entities, *self._publishers.values()]:
            with contextlib.suppress(zenoh.ZError):
                entity.undeclare()
        self._entities.clear()
        self._publishers.clear()
        with contextlib.suppress(zenoh.ZError):
            self._session.close()


class RawSession:
    """A Zenoh network that is not ours, such as ROS 2's: plain keys and bytes, for an arm driver.

    Callbacks run on Zenoh's thread and may only enqueue. Close it, or the process hangs at its end.
    """

    def __init__(self, *, connect: Sequence[str] = (), listen: Sequence[str] = (), mode: str = "client") -> None:
        """Opens the session.

        Raises:
            UserError: if a client finds nobody at `connect`, or an endpoint cannot be listened on.
        """
        config = zenoh.Config()
        settings: dict[str, Any] = {
            "mode": mode,
            "listen/endpoints": list(listen),
            "connect/endpoints": list(connect),
            "connect/timeout_ms": 2000,
            "connect/exit_on_failure": True,
            "scouting/multicast/enabled": False,
            "scouting/gossip/enabled": False,
        }
        for key, value in settings.items():
            config.insert_json5(key, json.dumps(value))
        try:
            self._session = zenoh.open(config)
        except zenoh.ZError as error:
            raise UserError(
                f"Expected a Zenoh router at {', '.join(connect) or ', '.join(listen)}, but Zenoh says: {error}"
            ) from error
        self._entities: list[Any] = []
        self.id = str(self._session.zid())

    def put(self, key: str, payload: bytes, *, attachment: bytes = b"") -> None:
        """Sends bytes, and loses none that the network can carry."""
        self._session.put(key, payload, attachment=attachment or None, congestion_control=zenoh.CongestionControl.BLOCK)

    def query(self, key: str, payload: bytes) -> None:
        """Sends a query to whoever serves a key, without waiting for the answer."""
        self._session.get(key, lambda _: None, payload=payload)

    def subscribe(self, key: str, handler: Callable[[bytes, bytes], None]) -> None:
        """Calls `handler(payload, attachment)` for every sample of a key."""

        def callback(sample: zenoh.Sample) -> None:
            handler(sample.payload.to_bytes(), sample.attachment.to_bytes() if sample.attachment else b"")

        self._entities.append(self._session.declare_subscriber(key, callback))

    def announce(self, key: str) -> None:
        """Holds a liveliness token until the session is closed."""
        self._entities.append(self._session.liveliness().declare_token(key))

    def announced(self, pattern: str, *, timeout_s: float = 1.0) -> list[str]:
        """Returns the keys of the currently known liveliness tokens that match a pattern."""
        replies = self._session.liveliness().get(pattern, timeout=timeout_s)
        return [str(reply.ok.key_expr) for reply in replies if reply.ok is not None]

    def close(self) -> None:
        """Leaves the network."""
        for entity in self._entities:
            with contextlib.suppress(zenoh.ZError):
                entity.undeclare()
        self._entities.clear()
        with contextlib.suppress(zenoh.ZError):
            self._session.close()

"""The view of a session that is running: fed from the bus, served on the loopback address, never in anybody's way."""

from __future__ import annotations

import contextlib
import queue
import threading
import time
from collections import Counter
from collections.abc import Collection

import rerun as rr

from shared import topics
from shared.bus import Bus, Received
from shared.errors import UserError
from shared.messages import ClockOffset, Message
from shared.programs import how_to_call
from shared.system import desktop
from station.view import viewer
from station.view.canvas import Cap
from station.view.layout import layout
from station.view.part import Rates
from station.view.rrd import new_recording
from station.view.scene import SceneLogger
from station.view.setup import Setup

PORT = 9876
LIVE_RATES = Rates(image_hz=12.0, drawing_hz=15.0)
LIVE_CAPS_HZ = {"camera/image": 12.0, "arm/joints": 15.0, "arm/platform": 30.0, "camera/plate": 5.0, "tf": 2.0}
"""Topics that come oftener are thinned out before they are decoded; the corners, which decide, never are."""

USUAL_TOPICS = frozenset({"camera/corners", "camera/image", "arm/joints", "arm/platform"})
_CAPACITY = 2_000
_FLUSH_S = 0.25
_CLOSE_S = 2.0


class StationTime:
    """The moments of messages on the station's clock: agents' stamps are moved by their measured offsets."""

    def __init__(self) -> None:
        self._offsets_ns: dict[str, int] = {}

    def of(self, topic: str, message: Message, *, receive_ns: int) -> int:
        """Returns the nanoseconds since the epoch; the time of receipt for a message without a stamp."""
        if isinstance(message, ClockOffset):
            self._offsets_ns[message.agent] = message.offset_ns
        stamp_ns = topics.capture_ns(message)
        return stamp_ns + self._offsets_ns.get(topics.topic(topic).sender, 0) if stamp_ns > 0 else receive_ns


class LiveView:
    """Draws what it is given, on a thread of its own, for viewers that connect to `uri`.

    `take` only enqueues: when the drawing cannot keep up, messages are dropped and counted in `dropped`. What viewers
    that come later still get to see is bounded by `memory`. Close it, or use it as a context manager.
    """

    def __init__(
        self,
        *,
        setup: Setup,
        port: int = PORT,
        expected: Collection[str] = USUAL_TOPICS,
        rates: Rates = LIVE_RATES,
        memory: str = "256MiB",
    ) -> None:
        """Serves on 127.0.0.1 at `port`, or at another one if that is taken; `expected` topics decide the layout."""
        self.dropped: Counter[str] = Counter()
        self.fault = ""
        self._queue: queue.Queue[Received] = queue.Queue(_CAPACITY)
        self._caps = {topic: Cap(rate_hz) for topic, rate_hz in LIVE_CAPS_HZ.items()}
        self._closing = threading.Event()
        self._recording = new_recording()
        sink = rr.GrpcServerSink(bind_ip=viewer.LOOPBACK, port=viewer.free_port(port), server_memory_limit=memory)
        self._recording.set_sinks(sink)
        self.uri: str = sink.uri
        self._recording.send_recording_name("live")
        blueprint = layout(expected, setup=setup, live=True)
        self._recording.send_blueprint(blueprint, make_active=True, make_default=True)
        self._logger = SceneLogger(self._recording, setup=setup, rates=rates)
        self._station_time = StationTime()
        self._thread = threading.Thread(target=self._run, name="view", daemon=True)
        self._thread.start()

    def __enter__(self) -> LiveView:
        """Returns itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Closes the view."""
        self.close()

    def attach(self, bus: Bus) -> None:
        """Takes every topic of a bus."""
        bus.subscribe("**", self.take)

    def take(self, received: Received) -> None:
        """Enqueues a message if it will be drawn; returns at once, whatever the viewers do."""
        if self._closing.is_set() or not self._logger.wants(received.topic):
            return
        cap = self._caps.get(received.topic)
        if cap is not None and not cap.due(received.receive_ns):
            return
        try:
            self._queue.put_nowait(received)
        except queue.Full:
            self.dropped[received.topic] += 1

    def open_viewer(self) -> bool:
        """Opens a viewer if there is a display; says whether it did."""
        if desktop.has_display():
            viewer.open_stream(self.uri)
            return True
        return False

    @property
    def how_to_look(self) -> str:
        """The instructions for seeing it, here or from another machine."""
        port = self.uri.rsplit(":", 1)[-1].split("/")[0]
        return (
            f"Look with: {how_to_call('rerun')} --connect {self.uri}\n"
            f"From another machine: ssh -L {port}:127.0.0.1:{port} THIS_MACHINE, and the same command there."
        )

    def close(self) -> None:
        """Draws what waits, within two seconds, and stops serving."""
        if self._closing.is_set():
            return
        self._closing.set()
        self._thread.join(_CLOSE_S)
        with contextlib.suppress(Exception):  # a viewer that went away must not keep the session from ending
            self._recording.flush(timeout_sec=_CLOSE_S)
        self._recording.disconnect()

    def _run(self) -> None:
        flush_s = time.monotonic() + _FLUSH_S
        while not (self._closing.is_set() and self._queue.empty()):
            with contextlib.suppress(queue.Empty):
                self._draw(self._queue.get(timeout=_FLUSH_S))
            if time.monotonic() >= flush_s:
                flush_s = time.monotonic() + _FLUSH_S
                self._logger.flush()
        self._logger.flush()

    def _draw(self, received: Received) -> None:
        try:
            message = received.message
            stamp_ns = self._station_time.of(received.topic, message, receive_ns=received.receive_ns)
            self._logger.log(received.topic, message, stamp_ns)
        except UserError as error:  # a message of another version; the recorder keeps it, the doctor names it
            self.fault = self.fault or str(error)

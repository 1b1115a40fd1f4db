"""Joins the comparison's state machine to a bus, live or simulated: heartbeat, commands, events, log."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from shared.bus import Bus, Received
from shared.clock import Clock
from shared.foxglove import Log, Timestamp
from shared.messages import AngleReading, ArmReply, Heartbeat, Message, MotionReport, RunEvent, TiltCommand
from shared.topics import ANGLE_PREFIX
from station.angles.procedure import Output, Phase, Procedure
from station.angles.settings import SourceName
from station.angles.watch import Note

HEARTBEAT_NS = 50_000_000


def _say_nothing(_: Note) -> None:
    return


class Conductor:
    """Feeds a `Procedure` from the bus and does what it says. `tick` it at least every 50 ms."""

    def __init__(
        self,
        bus: Bus,
        procedure: Procedure,
        *,
        sources: tuple[SourceName, ...],
        clock: Clock,
        on_note: Callable[[Note], None] = _say_nothing,
        owner: str = "",
    ) -> None:
        """`owner` is the session's name, under which it has the arm; a simulated one is alone and needs none."""
        self._owner = owner
        self._bus, self._procedure, self._clock, self._on_note = bus, procedure, clock, on_note
        self._beat_ns, self._sent, self._came_back = 0, 0, 0
        for source in sources:
            bus.subscribe(ANGLE_PREFIX + source.name, self._on_reading)
        bus.subscribe("arm/motion", self._on_motion)
        bus.subscribe("session/event", self._on_event)

    @property
    def finished(self) -> bool:
        """True if the comparison is over, for good or bad."""
        return self._procedure.phase in (Phase.DONE, Phase.FAILED)

    @property
    def all_came_back(self) -> bool:
        """True if the bus has brought back every event: a recorder on the same bus then has them, too."""
        return self._came_back >= self._sent

    def _on_event(self, _: Received) -> None:
        self._came_back += 1

    def _on_reading(self, received: Received) -> None:
        reading = received.message
        if isinstance(reading, AngleReading):
            self._procedure.on_reading(reading.source, stamp_ns=reading.stamp_ns)

    def _on_motion(self, received: Received) -> None:
        if isinstance(received.message, MotionReport):
            self._procedure.on_motion(received.message, now_ns=self._clock.now_ns())

    def tick(self) -> None:
        """Does what is due now."""
        now_ns = self._clock.now_ns()
        if now_ns - self._beat_ns >= HEARTBEAT_NS:
            self._beat_ns = now_ns
            self._bus.publish("session/heartbeat", Heartbeat(now_ns, not self.finished, self._owner))
        self._procedure.tick(now_ns)
        for output in self._procedure.take_outputs():
            self._send(output)

    def _send(self, output: Output) -> None:
        if isinstance(output, TiltCommand):
            output = replace(output, owner=self._owner)
            self._bus.publish("arm/command", output)
            self._bus.request("arm/command", output, self._on_reply, timeout_s=2.0)
        elif isinstance(output, RunEvent):
            self._sent += 1
            self._bus.publish("session/event", output)
        else:
            stamp = Timestamp.from_ns(self._clock.now_ns())
            line = Log(timestamp=stamp, level=output.level, message=output.text, name="compare-angles")
            self._bus.publish("log", line)
            self._on_note(output)

    def _on_reply(self, reply: Message | None) -> None:
        known = reply if isinstance(reply, ArmReply) else None
        self._procedure.on_reply(known, now_ns=self._clock.now_ns())

    def disarm(self) -> None:
        """Sends the last heartbeat: the arm is to hold, and obeys nobody any more."""
        self._bus.publish("session/heartbeat", Heartbeat(self._clock.now_ns(), armed=False, owner=self._owner))

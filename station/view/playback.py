"""Plays a recording back onto the bus in its own timing, so that whatever listens to a live rig can listen to it."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from typing import Protocol

from shared import topics
from shared.bus import Bus
from shared.clock import Clock
from shared.errors import UserError
from shared.messages import ArmReply, ArmStop, ClockPing, ClockPong, FrameReply, Message, TiltCommand
from shared.rig import PROCESSES, BusConfig

STAND_INS = ("camera", "arm", "twin", "station")


class Recorded(Protocol):
    """A recorded message, as `station.recording.reader` gives them."""

    @property
    def topic(self) -> str:
        """The topic's name, as on the bus."""
        ...

    @property
    def log_ns(self) -> int:
        """The moment at which the station received it."""
        ...

    @property
    def message(self) -> Message:
        """The message itself."""
        ...


@dataclass(frozen=True, kw_only=True)
class Endpoints:
    """The endpoints on which a playback listens and to which it connects."""

    listen: tuple[str, ...]
    connect: tuple[str, ...]


def endpoints_of(config: BusConfig, *, stand_ins: Collection[str]) -> Endpoints:
    """Returns the endpoints of the processes that the playback stands in for, and those that they connect to.

    A process connects to those before it in `PROCESSES`, so the playback connects to a process that stands before all
    of its own; the others come by themselves.
    """
    own = [name for name in PROCESSES if name in stand_ins]
    first = PROCESSES.index(own[0]) if own else len(PROCESSES)
    listen = tuple(endpoint for name in own for endpoint in config.endpoint(name))
    connect = tuple(endpoint for name in PROCESSES[:first] for endpoint in config.endpoint(name))
    return Endpoints(listen=listen, connect=connect)


def topics_of(names: Iterable[str], *, stand_ins: Collection[str]) -> frozenset[str]:
    """Returns the topics of a recording that the processes stood in for (or anybody) would send.

    Unknown ones are not, nor what only simulators tell each other: nobody who measures may hear the truth.
    """
    found: set[str] = set()
    for name in names:
        try:
            line = topics.topic(name)
        except UserError:
            continue
        if line.recorded and line.sender != "twin" and line.sender in ("any", *stand_ins):
            found.add(name)
    return frozenset(found)


class Playback:
    """Stands in for processes: announces them, answers their services, publishes what they had sent.

    A command that the recording holds is accepted, since its motion will follow; any other is refused with the reason.
    """

    def __init__(self, bus: Bus, *, clock: Clock, stand_ins: Collection[str], commands: Collection[tuple[int, int]]):
        """`commands` are run and step of every tilt command in the recording."""
        self._bus, self._clock, self._commands = bus, clock, frozenset(commands)
        if "camera" in stand_ins:
            bus.serve("camera/clock", self._pong, direct=True)
            bus.serve("camera/frames", lambda _: FrameReply(reason="a recording is being played back"))
        if "arm" in stand_ins:
            bus.serve("arm/clock", self._pong, direct=True)
            bus.serve("arm/lease", lambda _: ArmReply(accepted=True))
            bus.serve("arm/command", self._answer)
            bus.serve("arm/stop", self._stop)
        self.stopped = ""
        for name in stand_ins:
            bus.announce(name)

    def _pong(self, ping: Message) -> ClockPong:
        assert isinstance(ping, ClockPing)
        return ClockPong(station_ns=ping.station_ns, agent_ns=self._clock.now_ns())

    def _answer(self, command: Message) -> ArmReply:
        assert isinstance(command, TiltCommand)
        if (command.run, command.step) in self._commands:
            return ArmReply(accepted=True)
        reason = f"a recording is being played back, and it holds no command of run {command.run}, step {command.step}"
        return ArmReply(accepted=False, reason=reason)

    def _stop(self, stop: Message) -> ArmReply:
        assert isinstance(stop, ArmStop)
        self.stopped = stop.reason or "the arm was asked to stop"
        return ArmReply(accepted=True)

    def play(
        self,
        items: Iterable[Recorded],
        *,
        speed: float = 1.0,
        on_second: Callable[[float], None] = lambda _: None,
        monotonic_ns: Callable[[], int] = time.monotonic_ns,
    ) -> int:
        """Publishes messages as far apart as they were received, divided by `speed`; gives their number.

        `on_second` hears of every second of the recording that has passed. An emergency stop ends the playback.

        Raises:
            UserError: if the speed is not positive.
        """
        if not (math.isfinite(speed) and speed > 0):
            raise UserError(f"Expected a positive speed, got {speed:g}; 1 is the recording's own, 2 twice as fast")
        begin_ns, first_ns, count, said = monotonic_ns(), None, 0, 0
        for item in items:
            first_ns = item.log_ns if first_ns is None else first_ns
            due_ns = begin_ns + int((item.log_ns - first_ns) / speed)
            while (wait_ns := due_ns - monotonic_ns()) > 0 and not self.stopped:
                self._bus.poll(min(wait_ns * 1e-9, 0.1))
            if self.stopped:
                break
            self._bus.poll()
            self._bus.publish(item.topic, item.message)
            count += 1
            if (elapsed_s := (item.log_ns - first_ns) * 1e-9) >= said + 1:
                said = int(elapsed_s)
                on_second(elapsed_s)
        return count

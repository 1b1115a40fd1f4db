"""A session: the state machine joined to a bus. The same in real and in simulated time."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import replace

from shared import frames
from shared.bus import Bus, Received, Recipe
from shared.foxglove import LEVELS, Log, Timestamp
from shared.messages import (
    ArmReply,
    CameraGeometry,
    Heartbeat,
    MarkerCorners,
    Message,
    PlatformState,
    TiltCommand,
)
from station.sampling.actions import Action, Finish, Report, Say, Tilt
from station.sampling.machine import INPUTS, SamplingMachine

HEARTBEAT_NS = 50_000_000
TRANSFORMS_NS = 33_333_333
_NO_ANSWER = "the arm agent did not answer; is `station arm` running?"
_GONE = "the arm agent has left the bus; start `station arm` again"


class Session:
    """Feeds the machine what arrives and does what it says. `tick` publishes the heartbeat and the transforms."""

    def __init__(
        self,
        bus: Bus,
        machine: SamplingMachine,
        *,
        block_height_m: float,
        pivot_above_plate_m: float,
        on_line: Callable[[str, str], None],
        owner: str = "",
    ) -> None:
        """`owner` is the session's name, under which it has the arm; simulated sessions are alone and need none."""
        self._bus, self._machine, self._on_line, self._owner = bus, machine, on_line, owner
        self._sizes = {"block_height_m": block_height_m, "pivot_above_plate_m": pivot_above_plate_m}
        self._waiting: deque[Received] = deque()
        self._busy = False
        self._now_ns = 0
        self._heartbeat_ns = self._transforms_ns = 0
        self._seen: dict[type[Message], Message] = {}
        self.finished = False
        self.armed = True
        """True if the heartbeat asks the arm to go on obeying; kept until the plate is level again."""
        self.fault = ""
        self.asked: TiltCommand | None = None
        """The last command."""
        for topic in INPUTS:
            bus.subscribe(topic, self._take)

    @property
    def machine(self) -> SamplingMachine:
        """The state machine."""
        return self._machine

    def stop(self, reason: str, *, now_ns: int) -> None:
        """Ends the session early: the plate goes back to level."""
        self._perform(self._machine.stop(reason, now_ns=now_ns))

    # --- in ----------------------------------------------------------------------------------------------------------

    def _take(self, received: Received) -> None:
        """Hands messages to the machine one by one, also those that its own actions bring about."""
        if self._busy:
            self._waiting.append(received)
            return
        self._busy = True
        try:
            self._hear(received)
            while self._waiting:
                self._hear(self._waiting.popleft())
        finally:
            self._busy = False

    def _hear(self, received: Received) -> None:
        message, now_ns = received.message, received.receive_ns
        self._seen[type(message)] = message
        self._now_ns = now_ns
        if actions := self._machine.handle(message, now_ns=now_ns):
            self._perform(actions)

    # --- out ---------------------------------------------------------------------------------------------------------

    def _perform(self, actions: list[Action]) -> None:
        for action in actions:
            if isinstance(action, Report):
                name = "session/event" if hasattr(action.message, "phase") else "session/sample"
                self._bus.publish(name, action.message)
            elif isinstance(action, Tilt):
                self._command(action.command)
            elif isinstance(action, Say):
                self.say(action.level, action.text)
            else:
                self._finish(action)

    def _finish(self, action: Finish) -> None:
        self.finished, self.fault = True, action.fault

    def _command(self, command: TiltCommand) -> None:
        self.asked = command
        self._bus.publish("arm/command", command)

        def on_reply(reply: Message | None) -> None:
            self._answer(command, reply if isinstance(reply, ArmReply) else ArmReply(reason=_NO_ANSWER, passing=True))

        self._bus.request("arm/command", command, on_reply, timeout_s=2.0)

    def _answer(self, command: TiltCommand, reply: ArmReply) -> None:
        stamped = replace(reply, stamp_ns=self._now_ns, run=command.run, step=command.step)
        self._bus.publish("arm/reply", stamped)

    def arm_is_gone(self) -> None:
        """Answers for an arm agent that has died: nobody else will report the end of the motion under way."""
        if self.asked is not None:
            self._answer(self.asked, ArmReply(reason=_GONE, passing=True))

    def say(self, level: str, text: str) -> None:
        """Writes one line to the log on the bus and to the terminal."""
        stamp = Timestamp.from_ns(self._now_ns)
        self._bus.publish("log", Log(timestamp=stamp, level=LEVELS[level], message=text, name="station"))
        self._on_line(level, text)

    # --- time --------------------------------------------------------------------------------------------------------

    def tick(self, now_ns: int) -> None:
        """Does what is due at `now_ns`; call it at least 30 times a second."""
        self._now_ns = max(self._now_ns, now_ns)
        if now_ns >= self._heartbeat_ns:
            self._heartbeat_ns = now_ns + HEARTBEAT_NS
            self._bus.publish("session/heartbeat", Heartbeat(stamp_ns=now_ns, armed=self.armed, owner=self._owner))
        if now_ns >= self._transforms_ns:
            self._transforms_ns = now_ns + TRANSFORMS_NS
            if self._bus.carries("tf"):
                self._publish_transforms(now_ns)

    def _publish_transforms(self, now_ns: int) -> None:
        attitude, corners, geometry = map(self._seen.get, (PlatformState, MarkerCorners, CameraGeometry))
        if attitude or geometry:
            seen = {"now_ns": now_ns, "attitude": attitude, "geometry": geometry, "corners": corners}
            self._bus.publish("tf", Recipe(frames.seen, seen | self._sizes))

"""A tilt stage as deploy/tilt_stage's sketch makes one: a pure object in simulated time, and its end of a pty.

`python -m tests.tilt_stage.emulated LINK RIG` serves one on a pty named LINK in real time; the rig's twin carries
plate and block along with it, so that the camera sees what the stage does.
"""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections.abc import Generator
from dataclasses import dataclass, field
from pathlib import Path

from station.arm.drivers._servo_lines import FOLLOWING, HELD, IDLE, LEVELLING, PER_DEGREE, VERSION, Lines, line
from tests.pseudo_terminal import Pty

PERIOD_MS = 10
WATCHDOG_MS, LEVEL_AFTER_MS = 500, 5000
FASTEST, LEVELLING_SPEED, JUMP = 60 * PER_DEGREE, 3 * PER_DEGREE, 5 * PER_DEGREE


@dataclass
class EmulatedStage:
    """A stage of some axes; `us_per_90` is the resolution of its servos (0: they turn by any angle)."""

    axes: int = 2
    limit: int = 68 * PER_DEGREE
    us_per_90: int = 900
    fastest: int = FASTEST
    placed: bool = False
    names: bool = True
    """Its sketch knows that a board's life has a name."""
    pressed: bool = False
    """The stop button."""
    state: str = IDLE
    number: int = 0
    at: list[int] = field(default_factory=list[int])
    said: bytes = b""
    """The bytes that it has said since somebody took them."""

    def __post_init__(self) -> None:
        self.at = self.at or [0] * self.axes
        self.goal, self.speed = list(self.at), [0] * self.axes
        self.now_ms = self.heard_ms = 0
        self.lines, self.life = Lines(), 0

    def restart(self) -> None:
        """Begins a new life: it knows of nothing, wherever its plate stands."""
        self.at, self.goal, self.speed = ([0] * self.axes for _ in range(3))
        self.state, self.number, self.placed, self.life = IDLE, 0, False, 0

    def hear(self, data: bytes) -> None:
        """Obeys what has come."""
        for words in self.lines.take(data):
            kind, life = words[0][0], int(words[1]) if self.names and len(words) > 1 else 0
            if kind == "?":
                self.life = life
                limits = (number for _ in range(self.axes) for number in (-self.limit, self.limit))
                self.said += line("I", VERSION, self.axes, int(self.placed), *limits, *self.named())
            elif kind == "A" and life == self.life and self.state != FOLLOWING and not self.pressed:
                self.goal, self.state, self.placed, self.heard_ms = list(self.at), FOLLOWING, True, self.now_ms
            elif kind == "S":
                self.stop()
            elif kind == "T" and self.state == FOLLOWING:
                self.follow([int(word) for word in words[1:]])

    def follow(self, numbers: list[int]) -> None:
        for wanted, at in zip(numbers[1:], self.at, strict=True):
            if abs(wanted) > self.limit or abs(wanted - at) > JUMP:
                self.said += line("E", "limit" if abs(wanted) > self.limit else "jump")
                return
        self.number, self.goal, self.heard_ms = numbers[0], numbers[1:], self.now_ms

    def stop(self) -> None:
        self.goal, self.state = list(self.at), IDLE

    def advance(self, to_ms: int) -> None:
        """Lets time pass, in the sketch's own steps."""
        while self.now_ms + PERIOD_MS <= to_ms:
            self.now_ms += PERIOD_MS
            self.mind(self.now_ms - self.heard_ms)
            self.move()
            places = (number for pair in zip(self.places(), self.speed, strict=True) for number in pair)
            self.said += line("P", self.state, self.number, *places, *self.named())

    def named(self) -> list[int]:
        """The name of its life, if it was given one."""
        return [self.life] if self.life else []

    def mind(self, silent_ms: int) -> None:
        if self.pressed:
            self.stop()
        if self.state == FOLLOWING and silent_ms > WATCHDOG_MS:
            self.stop()
            self.state = HELD
        if self.state == HELD and silent_ms > WATCHDOG_MS + LEVEL_AFTER_MS:
            self.state = LEVELLING

    def move(self) -> None:
        steps = 1000 // PERIOD_MS
        levelling = self.state == LEVELLING
        furthest = (LEVELLING_SPEED if levelling else self.fastest) // steps
        for axis, goal in enumerate(self.goal):
            way = max(-furthest, min(furthest, (0 if levelling else goal) - self.at[axis]))
            self.at[axis] += way
            self.speed[axis] = way * steps
        if levelling and not any(self.at):
            self.stop()

    def places(self) -> list[int]:
        """The angles of the pulses that its servos get."""
        if not self.us_per_90:
            return list(self.at)
        pulses = [_rounded(_whole(at, 1000) * self.us_per_90, 90000) for at in self.at]
        return [1000 * _rounded(pulse * 90000, self.us_per_90) for pulse in pulses]

    def take(self) -> bytes:
        """Returns what it has said since the last call."""
        said, self.said = self.said, b""
        return said


def _rounded(n: int, d: int) -> int:
    """The quotient as the sketch rounds it, half away from zero."""
    return (1 if n >= 0 else -1) * ((abs(n) + d // 2) // d)


def _whole(n: int, d: int) -> int:
    """The quotient towards zero, as C divides."""
    return (1 if n >= 0 else -1) * (abs(n) // d)


class Served:
    """A stage at its end of a cable; `port` is the name of the other end."""

    def __init__(self, stage: EmulatedStage) -> None:
        self.stage, self._cable = stage, Pty()
        self.port = self._cable.name

    def serve(self, now_ms: int) -> None:
        """Hears, moves and reports until `now_ms`; called often. What nobody reads is lost, as on a cable."""
        self.stage.hear(self._cable.read())
        self.stage.advance(now_ms)
        self._cable.write(self.stage.take())

    def close(self) -> None:
        self._cable.close()


@contextlib.contextmanager
def opened(stage: EmulatedStage) -> Generator[Served]:
    pty = Served(stage)
    try:
        yield pty
    finally:
        pty.close()


@contextlib.contextmanager
def answering(pty: Served) -> Generator[None]:
    """Lets the stage answer from a thread, in no time of its own, while a driver connects."""
    ended = threading.Event()

    def serve() -> None:
        while not ended.wait(0.005):
            pty.serve(pty.stage.now_ms)

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def main(link: Path, rig_file: str) -> None:
    """Serves a stage in real time, and moves the twin as it moves."""
    from shared.clock import SystemClock  # noqa: PLC0415 - the object above needs no bus
    from shared.messages import JointTarget  # noqa: PLC0415
    from shared.rig import load_rig  # noqa: PLC0415
    from shared.zenoh_bus import ZenohBus  # noqa: PLC0415

    rig, clock = load_rig(Path(rig_file)), SystemClock()
    began_ns = clock.now_ns()
    degree = 3.141592653589793 / 180 / PER_DEGREE
    with opened(EmulatedStage()) as pty, ZenohBus(rig.id, connect=rig.bus.peers("observer")) as bus:
        link.symlink_to(pty.port)
        print(f"The emulated stage is at {link}.", flush=True)
        while True:
            time.sleep(0.002)  # often: of two reports that come together a driver keeps the newer one
            before_ms = pty.stage.now_ms
            pty.serve((clock.now_ns() - began_ns) // 1_000_000)
            if pty.stage.now_ms == before_ms:
                continue
            position = tuple(degree * angle for angle in pty.stage.at)
            velocity = tuple(degree * speed for speed in pty.stage.speed)
            bus.publish("twin/target", JointTarget(clock.now_ns(), position, velocity))


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2])

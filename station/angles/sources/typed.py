"""Values typed in from a gauge with a display (the paper's Capri 20005): one at each stop of the plate.

A stop is announced on `session/event` (phase DWELL). Then either somebody is asked at the terminal, or the next line
of `file` is taken: one number a line, in `unit`; `#` begins a comment, `-` is a stop without a value.
"""

from __future__ import annotations

import math
import queue
import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TextIO

from shared.bus import Received
from shared.clock import Clock
from shared.config import Table, parse
from shared.errors import UserError
from shared.messages import RunEvent
from station.angles.reading import Reading, absent_reading
from station.angles.sources import SourceLink

ON_DEMAND = True


@dataclass(frozen=True, kw_only=True)
class TypedOptions:
    """`file` is relative to the rig file's folder; empty: ask at the terminal. `sign` as the gauge is mounted."""

    file: str = ""
    unit: Literal["deg", "rad"] = "deg"
    sign: Literal[1, -1] = 1

    def radians(self, text: str) -> float:
        """Returns the angle in a piece of text; ValueError when it is none."""
        value = float(text.replace(",", "."))
        angle = self.sign * (math.radians(value) if self.unit == "deg" else value)
        if not abs(angle) <= math.pi:
            raise ValueError(f"{value} {self.unit} is no tilt")
        return angle


class TypedSource:
    """An `AngleSource` whose sensor is a person, or a list."""

    def __init__(self, link: SourceLink) -> None:
        self._name, self._clock, self._complain = link.name, link.clock, link.complain
        self._options = parse(TypedOptions, link.options)
        self._lines = _lines(self._options.file, link.options) if self._options.file else None
        self._typed: queue.SimpleQueue[Reading] = queue.SimpleQueue()
        self._person: Person | None = None
        link.bus.subscribe("session/event", self._receive)

    def _receive(self, received: Received) -> None:
        event = received.message
        if not isinstance(event, RunEvent) or event.phase != "DWELL":
            return
        if self._lines is not None:
            self._take_line(self._lines)
        elif self._person is not None:
            self._person.ask(f"{self._name}, sweep {event.run}, stop {event.step} {event.reason}".rstrip())

    def _take_line(self, lines: Iterator[str]) -> None:
        text = next(lines, None)
        reading = absent_reading(self._clock.now_ns())
        if text is None:
            self._complain(f"the file {self._options.file} has no line for this stop")
        elif text != "-":
            try:
                reading = Reading(stamp_ns=reading.stamp_ns, angle_rad=self._options.radians(text))
            except ValueError:
                self._complain(f"the line {text!r} of {self._options.file} holds no angle")
        self._typed.put(reading)

    def open(self) -> None:
        """Begins to ask at the terminal, unless the angles come from a file."""
        if self._lines is None and self._person is None:
            self._person = Person(self._typed, options=self._options, clock=self._clock)

    def read(self) -> tuple[Reading, ...]:
        """Returns the angles that were typed, or taken from the file, since the last call."""
        return tuple(self._typed.get() for _ in range(self._typed.qsize()))

    def close(self) -> None:
        """Does nothing: a question that waits for its answer is left to wait."""


class Person:
    """Asks at the terminal, on a thread of its own because people take their time."""

    def __init__(
        self,
        answers: queue.SimpleQueue[Reading],
        *,
        options: TypedOptions,
        clock: Clock,
        terminal: TextIO | None = None,
        screen: TextIO | None = None,
    ) -> None:
        self._answers, self._options, self._clock = answers, options, clock
        self._terminal, self._screen = terminal or sys.stdin, screen or sys.stderr
        self._questions: queue.SimpleQueue[str] = queue.SimpleQueue()
        threading.Thread(target=self._converse, name="typed angles", daemon=True).start()

    def ask(self, stop: str) -> None:
        """Asks for the value at a stop."""
        self._questions.put(stop)

    def _converse(self) -> None:
        while True:
            stop = self._questions.get()
            while not self._answered(stop):
                pass

    def _answered(self, stop: str) -> bool:
        """Asks once; True when there was a value, or none will come."""
        self._say(f"{stop}: what does the gauge show, in {self._options.unit}? (nothing: no value) ")
        line = self._terminal.readline()
        if not line.strip():
            self._answers.put(absent_reading(self._clock.now_ns()))
            return True
        try:
            angle = self._options.radians(line.strip())
        except ValueError:
            self._say(f"Expected a number in {self._options.unit}, such as 4.25; got {line.strip()!r}.\n")
            return False
        self._answers.put(Reading(stamp_ns=self._clock.now_ns(), angle_rad=angle))
        return True

    def _say(self, text: str) -> None:
        self._screen.write(text)
        self._screen.flush()


def _lines(file: str, options: Table) -> Iterator[str]:
    path = Path(options.file).parent / file
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(f"Expected typed angles in {path}, one a line, but it cannot be read: {error}") from error
    lines = (line.partition("#")[0].strip() for line in text.splitlines())
    return iter([line for line in lines if line])


def connect(link: SourceLink) -> TypedSource:
    """Returns the source for a table of rig.toml."""
    return TypedSource(link)

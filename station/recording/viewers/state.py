"""The session's state in words, when it changes: run, phase, direction and the last sample."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import ClassVar

from shared.messages import Message, RunEvent, Sample, TiltCommand
from shared.rig import RigConfig
from station.recording import ros2
from station.recording.viewers.extra import Extra, Handler, ros
from station.rig.placed_arm import PlacedArm

TOPIC = "session/state"
WITHIN_A_PHASE = frozenset({"STEP_BEGIN", "STEP_END", "SYNC"})
STATE_TOPICS = ("session/event", "arm/command", "session/sample")
"""The topics that the state is made of."""


class SessionState:
    """Writes the session's state in words when it changes."""

    topics: ClassVar[frozenset[str]] = frozenset({TOPIC})

    def __init__(self, _rig: RigConfig, _arm: PlacedArm) -> None:
        self._state = State()

    def handlers(self) -> Mapping[str, Handler]:
        """Returns one handler for all topics that the state is made of."""
        return dict.fromkeys(STATE_TOPICS, self._on_message)

    def _on_message(self, message: Message, _: int) -> Iterable[Extra]:
        if self._state.take(message):
            yield Extra(TOPIC, ros(ros2.STRING), ros2.string(self._state.text()))


class State:
    """The session's state in words."""

    def __init__(self) -> None:
        self._run, self._phase, self._direction = 0, "", ""
        self._last, self._samples = "", 0

    def take(self, message: Message) -> bool:
        """Returns true if the words change with this message."""
        before = self.text()
        if isinstance(message, RunEvent) and message.phase not in WITHIN_A_PHASE:
            self._run, self._phase = message.run, message.phase
            if message.phase == "LEVEL":
                self._direction = ""
        elif isinstance(message, TiltCommand) and message.angle_rad > 0:
            self._direction = _direction(message.direction, message.azimuth_rad)
        elif isinstance(message, Sample):
            self._samples += 1
            self._last = f"; {result(message)}"
        return self.text() != before

    def present(self) -> str:
        """Returns the run, its phase and its direction; nothing before the first phase."""
        run = f"Run {self._run}: {self._phase}" if self._phase else ""
        return ", ".join(part for part in (run, self._direction) if part)

    def text(self) -> str:
        """Returns two lines: the present, and what has been measured."""
        count = "1 sample" if self._samples == 1 else f"{self._samples} samples"
        return f"{self.present()}\n{count}{self._last}"


def result(sample: Sample) -> str:
    """Returns a run's result in words."""
    angle = f"{math.degrees(sample.onset_angle_rad):.2f}°"
    outcome = f"no slip up to {angle}" if sample.censored else f"slip at {angle}"
    left_out = f", left out: {', '.join(sample.flags)}" if sample.flags else ""
    return f"run {sample.run}: {outcome}{left_out}"


def _direction(number: int, azimuth_rad: float) -> str:
    azimuth = f"azimuth {math.degrees(azimuth_rad):.0f}°"
    return azimuth if number < 0 else f"direction {number} ({azimuth})"

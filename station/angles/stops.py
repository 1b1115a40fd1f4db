"""The stops of a comparison from its messages, as they were recorded."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from shared.messages import AngleReading, Message, RunEvent, TiltCommand
from shared.topics import ANGLE_PREFIX
from station.angles.plan import DONE_PHASE, READ_PHASE
from station.angles.reading import inclination

Array = NDArray[np.float64]
_SAME_RAD = math.radians(1e-3)


def is_needed(topic: str) -> bool:
    """Returns true if a comparison is computed from messages of this topic."""
    return topic in ("arm/command", "session/event") or topic.startswith(ANGLE_PREFIX)


@dataclass(frozen=True, kw_only=True)
class Series:
    """A source's readings at one stop, in the order of time: `stamp_ns` (n,), `angle_rad` (n,)."""

    stamp_ns: NDArray[np.int64]
    angle_rad: Array


@dataclass(frozen=True, kw_only=True)
class Stop:
    """One stop of the plate. `approach` is +1 after the tilt has grown, −1 after it has shrunk, 0 for the first.

    `angle_rad` is the commanded tilt; `series` is empty for a source that said nothing.
    """

    sweep: int
    step: int
    angle_rad: float
    approach: int
    begin_ns: int
    end_ns: int
    series: dict[str, Series]


@dataclass(slots=True)
class _Window:
    command: TiltCommand
    approach: int
    begin_ns: int = 0
    end_ns: int = 0


@dataclass(slots=True)
class _Gathered:
    windows: dict[tuple[int, int], _Window] = field(default_factory=dict[tuple[int, int], _Window])
    readings: dict[str, list[AngleReading]] = field(default_factory=dict[str, list[AngleReading]])
    angle_rad: float = 0.0
    approach: int = 0

    def take(self, message: Message) -> None:
        if isinstance(message, AngleReading):
            self.readings.setdefault(message.source, []).append(message)
        elif isinstance(message, TiltCommand):
            self._take_command(message)
        elif isinstance(message, RunEvent) and (window := self.windows.get((message.run, message.step))):
            if message.phase == READ_PHASE:
                window.begin_ns = message.stamp_ns
            elif message.phase == DONE_PHASE:
                window.end_ns = message.stamp_ns

    def _take_command(self, command: TiltCommand) -> None:
        if abs(grown := command.angle_rad - self.angle_rad) > _SAME_RAD:
            self.approach = 1 if grown > 0 else -1
        self.angle_rad = command.angle_rad
        self.windows[command.run, command.step] = _Window(command, self.approach)


def stops_of(messages: Iterable[Message]) -> tuple[Stop, ...]:
    """Returns the finished stops in order; readings belong to the stop in whose window their stamp falls."""
    gathered = _Gathered()
    for message in messages:
        gathered.take(message)
    windows = [window for window in gathered.windows.values() if 0 < window.begin_ns < window.end_ns]
    readings = {name: _stamped(found) for name, found in gathered.readings.items()}
    return tuple(_stop(window, readings) for window in windows)


@dataclass(frozen=True, slots=True)
class _Stamped:
    readings: list[AngleReading]
    stamp_ns: NDArray[np.int64]


def _stamped(readings: list[AngleReading]) -> _Stamped:
    ordered = sorted(readings, key=lambda reading: reading.stamp_ns)
    return _Stamped(ordered, np.array([reading.stamp_ns for reading in ordered], dtype=np.int64))


def _stop(window: _Window, readings: dict[str, _Stamped]) -> Stop:
    command = window.command
    return Stop(
        sweep=command.run,
        step=command.step,
        angle_rad=command.angle_rad,
        approach=window.approach,
        begin_ns=window.begin_ns,
        end_ns=window.end_ns,
        series={name: _within(stamped, window) for name, stamped in readings.items()},
    )


def _within(stamped: _Stamped, window: _Window) -> Series:
    low, high = np.searchsorted(stamped.stamp_ns, [window.begin_ns, window.end_ns + 1]).tolist()
    chosen = stamped.readings[low:high]
    azimuth = window.command.azimuth_rad
    angles = np.array([inclination(reading, azimuth_rad=azimuth) for reading in chosen], dtype=np.float64)
    known = np.isfinite(angles)  # one that was asked and had no value says NaN
    return Series(stamp_ns=stamped.stamp_ns[low:high][known], angle_rad=angles[known])

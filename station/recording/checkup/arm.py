"""Measures the delays from command to motion: until the arm begins, and until its joints are seen to turn the plate."""

from __future__ import annotations

import math
from dataclasses import dataclass

from shared.messages import REPLACED, MotionReport, PlatformState, TiltCommand
from station.recording.checkup.quantiles import Quantiles
from station.recording.reader import Recorded

SEEN_RAD = math.radians(0.02)
"""The turn of the plate that counts as motion: several times joint encoders' noise, passed within milliseconds."""


@dataclass(frozen=True, kw_only=True)
class ArmHealth:
    """Delays from the command: to the begin that the arm agent reports, and to the plate's having turned by 0.02°.

    `unanswered` commands have no report of a begin, `unfinished` ones none of an end; `faults` says why motions failed.
    """

    commands: int
    begin_p50_ms: float
    begin_p99_ms: float
    seen_p50_ms: float
    seen_p99_ms: float
    unanswered: int
    unfinished: int
    faults: tuple[str, ...]


class ArmWatch:
    """Collects what `ArmHealth` says."""

    def __init__(self) -> None:
        self._commands = 0
        self._begin, self._seen = Quantiles(), Quantiles()
        self._unanswered: dict[tuple[int, int], int] = {}
        self._unfinished: set[tuple[int, int]] = set()
        self._faults: list[str] = []
        self._attitude: PlatformState | None = None
        self._waiting: tuple[int, PlatformState] | None = None

    def add(self, item: Recorded) -> None:
        """Takes the next message of arm/command, arm/motion or arm/platform."""
        message = item.message
        if isinstance(message, TiltCommand):
            self._command(message, item.publish_ns)
        elif isinstance(message, MotionReport):
            self._motion(message, item.publish_ns - message.stamp_ns)
        elif isinstance(message, PlatformState):
            self._platform(message, item.publish_ns)

    def _command(self, command: TiltCommand, now_ns: int) -> None:
        self._commands += 1
        key = (command.run, command.step)
        self._unanswered[key] = now_ns
        self._unfinished.add(key)
        if self._attitude is not None:
            self._waiting = (now_ns, self._attitude)

    def _motion(self, report: MotionReport, offset_ns: int) -> None:
        key = (report.run, report.step)
        if (sent_ns := self._unanswered.pop(key, None)) is not None:
            self._begin.add(report.begin_ns + offset_ns - sent_ns)
        if report.end_ns:
            self._unfinished.discard(key)
        # A return begins in the middle of the step in which the block slipped: that is no fault.
        if report.fault and report.fault != REPLACED:
            self._faults.append(f"run {report.run}, step {report.step}: {report.fault}")

    def _platform(self, state: PlatformState, now_ns: int) -> None:
        self._attitude = state
        if self._waiting is None:
            return
        sent_ns, before = self._waiting
        if _turn_rad(before, state) > SEEN_RAD:
            self._seen.add(now_ns - sent_ns)
            self._waiting = None

    def health(self) -> ArmHealth:
        """Returns the findings of the messages so far."""
        return ArmHealth(
            commands=self._commands,
            begin_p50_ms=self._begin.at(0.5) * 1e-6,
            begin_p99_ms=self._begin.at(0.99) * 1e-6,
            seen_p50_ms=self._seen.at(0.5) * 1e-6,
            seen_p99_ms=self._seen.at(0.99) * 1e-6,
            unanswered=len(self._unanswered),
            unfinished=len(self._unfinished - self._unanswered.keys()),
            faults=tuple(self._faults),
        )


def _turn_rad(a: PlatformState, b: PlatformState) -> float:
    """Returns the angle between two attitudes, by the vector part of their quotient: accurate for small angles."""
    x = a.qw * b.qx - a.qx * b.qw - a.qy * b.qz + a.qz * b.qy
    y = a.qw * b.qy + a.qx * b.qz - a.qy * b.qw - a.qz * b.qx
    z = a.qw * b.qz - a.qx * b.qy + a.qy * b.qx - a.qz * b.qw
    return 2.0 * math.asin(min(1.0, math.sqrt(x * x + y * y + z * z)))

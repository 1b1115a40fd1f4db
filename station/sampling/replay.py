"""The replay law: over a recording, the state machine must take the decisions that it took live."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, fields
from itertools import zip_longest
from typing import TypeGuard

from shared import topics
from shared.messages import Message, RunEvent, Sample, TiltCommand
from station.sampling.actions import Action, Report, Tilt
from station.sampling.machine import INPUTS, SamplingMachine

DECISIONS = ("arm/command", "session/event", "session/sample")
"""The topics on which the machine's decisions are recorded."""
_TOPIC_OF: dict[type[Message], str] = {TiltCommand: DECISIONS[0], RunEvent: DECISIONS[1], Sample: DECISIONS[2]}
_ROUNDING = 1e-9
STOPPED = "stopped by"
"""The begin of the reason of an end that no message caused: what follows it cannot be replayed."""


@dataclass(frozen=True, slots=True)
class Difference:
    """The first decision that differs; None stands for no decision at all."""

    number: int
    recorded: Message | None
    replayed: Message | None

    def __str__(self) -> str:
        """The difference in one sentence."""
        if self.recorded is None or self.replayed is None or type(self.recorded) is not type(self.replayed):
            return f"decision {self.number}: recorded {self.recorded}, replayed {self.replayed}"
        names = [
            f"{spec.name} {getattr(self.recorded, spec.name)!r} against {getattr(self.replayed, spec.name)!r}"
            for spec in fields(self.recorded)
            if not _same(getattr(self.recorded, spec.name), getattr(self.replayed, spec.name))
        ]
        kind = type(self.recorded).__name__
        return f"decision {self.number}, a {kind}: recorded against replayed: {'; '.join(names)}"


@dataclass(frozen=True, slots=True)
class Verdict:
    """The number of decisions that were compared, and the first that differs, if any."""

    decisions: int
    difference: Difference | None


def replay(machine: SamplingMachine, stream: Iterable[tuple[str, Message, int]]) -> Verdict:
    """Feeds a recording to a fresh machine and compares its decisions with the recorded ones.

    Args:
        machine: built with the plan, seed, reach and specimen of the recording.
        stream: topic, message and receive time (ns) of everything of `INPUTS` and `DECISIONS`, by receive time.
    """
    # Each topic by itself: between topics the bus keeps no order, and the receive times of neighbours may swap.
    lanes = {topic: _Lane() for topic in DECISIONS}
    stopped_ns = None
    for topic, message, now_ns in stream:
        if topic in DECISIONS:
            if _stopped(message):
                stopped_ns = message.stamp_ns
                break
            lanes[topic].recorded.append(message)
        if topic in INPUTS:
            for decision in _decisions(machine.handle(message, now_ns=now_ns)):
                lanes[_TOPIC_OF[type(decision)]].replayed.append(decision)
    if stopped_ns is not None:
        lanes["arm/command"].end_at(stopped_ns)
    compared = 0
    for lane in lanes.values():
        count, difference = lane.compare()
        compared += count
        if difference is not None:
            return Verdict(compared, difference)
    return Verdict(compared, None)


@dataclass(slots=True)
class _Lane:
    """The decisions of one topic, as recorded and as replayed."""

    recorded: list[Message] = field(default_factory=list[Message])
    replayed: list[Message] = field(default_factory=list[Message])

    def end_at(self, stopped_ns: int) -> None:
        """Leaves out the commands from that moment on: one may have been received before the event that explains it."""
        before = [message for message in self.recorded if topics.capture_ns(message) < stopped_ns]
        self.recorded = before

    def compare(self) -> tuple[int, Difference | None]:
        """The number of decisions that agree, and the first that does not.

        A recording may end between an input and the decision that follows from it, but not the other way round.
        """
        pairs = zip_longest(self.recorded, self.replayed[: len(self.recorded)])
        for number, (recorded, replayed) in enumerate(pairs, start=1):
            if recorded is None or replayed is None or not _equal(recorded, replayed):
                return number - 1, Difference(number, recorded, replayed)
        return len(self.recorded), None


def _stopped(message: Message) -> TypeGuard[RunEvent]:
    return isinstance(message, RunEvent) and message.phase == "ABORTED" and message.reason.startswith(STOPPED)


def _decisions(actions: list[Action]) -> list[TiltCommand | RunEvent | Sample]:
    taken: list[TiltCommand | RunEvent | Sample] = []
    for action in actions:
        if isinstance(action, Tilt):
            taken.append(action.command)
        elif isinstance(action, Report):
            taken.append(action.message)
    return taken


def _equal(one: Message, other: Message) -> bool:
    return type(one) is type(other) and all(
        _same(getattr(one, spec.name), getattr(other, spec.name)) for spec in fields(one)
    )


def _same(one: object, other: object) -> bool:
    """True if both are equal, or both nan; floats may differ by rounding, as libraries sum in varying orders."""
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=_ROUNDING, abs_tol=_ROUNDING) or (math.isnan(one) and math.isnan(other))
    if isinstance(one, tuple) and isinstance(other, tuple):
        return len(one) == len(other) and all(_same(a, b) for a, b in zip(one, other, strict=True))  # pyright: ignore[reportUnknownArgumentType]
    return one == other

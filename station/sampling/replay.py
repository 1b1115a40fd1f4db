"""The replay law: over a recording, the state machine must take the decisions that it took live."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from itertools import zip_longest
from typing import TypeGuard

from shared import topics
from shared.messages import Message, RunEvent, Sample, TiltCommand
from shared.visible import shortened
from station.sampling.actions import Action, Report, Tilt
from station.sampling.machine import INPUTS, SamplingMachine

DECISIONS = ("arm/command", "session/event", "session/sample")
"""The topics on which the machine's decisions are recorded."""
_TOPIC_OF: dict[type[Message], str] = {TiltCommand: DECISIONS[0], RunEvent: DECISIONS[1], Sample: DECISIONS[2]}
_ROUNDING = 1e-9
STOPPED = "stopped by"
"""The begin of the reason of an end that no message caused: the machine does not decide it."""


@dataclass(frozen=True, slots=True)
class Difference:
    """The first decision that differs; None stands for no decision at all."""

    number: int
    recorded: Message | None
    replayed: Message | None

    @property
    def stamp_ns(self) -> int:
        """The time at which the decision was taken, by the recording if it is there."""
        return topics.capture_ns(_known(self.recorded or self.replayed))

    @property
    def changed(self) -> tuple[str, object, object]:
        """The first field that differs, as recorded and as replayed; without a name if one of them is missing."""
        if self.recorded is None or self.replayed is None:
            return "", self.recorded, self.replayed
        pairs = (
            (spec.name, getattr(self.recorded, spec.name), getattr(self.replayed, spec.name))
            for spec in fields(self.recorded)
        )
        return next(found for found in pairs if not _same(found[1], found[2]))

    def __str__(self) -> str:
        """Returns the difference in one sentence."""
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


def replay(machine: SamplingMachine, stream: Iterable[tuple[str, Message, int]]) -> dict[str, Verdict]:
    """Feeds a recording to a fresh machine and compares its decisions with the recorded ones; a verdict for each topic.

    Nothing may be missing but what was decided in the last `UNRECORDED_S`, and no sample whose run is recorded as done.
    A stop by hand ends the session: nothing but the command to level may be decided by it, or after it.

    Args:
        machine: built with the plan, seed, reach and specimen of the recording.
        stream: topic, message and receive time (ns) of everything of `INPUTS` and `DECISIONS`, by receive time.
    """
    return {topic: Verdict(*lane.compare()) for topic, lane in _lanes(machine, stream).items()}


def first_of(verdicts: Mapping[str, Verdict]) -> Difference | None:
    """Returns the earliest of all topics' differences; None if there is none."""
    found = [verdict.difference for verdict in verdicts.values() if verdict.difference is not None]
    return min(found, key=lambda one: one.stamp_ns, default=None)


UNRECORDED_S = 1.0
"""A decision so shortly before the end may not have reached the recorder. The recorder takes what is sent in the
same process within milliseconds; a busy machine is given a second."""


@dataclass(frozen=True, slots=True)
class _Stop:
    """A stop by hand: its stamp, the receive time of what came before it, and what was decided by then, by topic."""

    stamp_ns: int
    before_ns: int
    decided: Mapping[str, int]


def _lanes(machine: SamplingMachine, stream: Iterable[tuple[str, Message, int]]) -> dict[str, _Lane]:
    # Each topic by itself: between topics the bus keeps no order, and the receive times of neighbours may swap.
    lanes = {topic: _Lane() for topic in DECISIONS}
    stop, end_ns = None, 0
    for topic, message, now_ns in stream:
        if topic in DECISIONS:
            lanes[topic].recorded.append(message)
        if isinstance(message, RunEvent):  # only the last one can have ended the session: it went on after any other
            decided = {topic: len(lane.replayed) for topic, lane in lanes.items()}
            stop = _Stop(message.stamp_ns, end_ns, decided) if _stopped(message) else None
        if topic in INPUTS:
            for decision in _decisions(machine.handle(message, now_ns=now_ns)):
                lanes[_TOPIC_OF[type(decision)]].decided(decision, now_ns)
        end_ns = now_ns
    for lane in lanes.values():
        lane.end_ns = end_ns
    lanes["session/sample"].proven = sum(_done(event) for event in lanes["session/event"].recorded)
    if stop is not None:
        _end_at(stop, lanes)
    return lanes


def _end_at(stop: _Stop, lanes: Mapping[str, _Lane]) -> None:
    """Leaves out the stop, its command to level, and whatever a session would have decided that had gone on."""
    lanes["session/event"].recorded.pop()
    commands = lanes["arm/command"]
    commands.recorded = [message for message in commands.recorded if not _levels(message, stop)]
    for topic, lane in lanes.items():
        del lane.replayed[stop.decided[topic] :], lane.decided_ns[stop.decided[topic] :]
        lane.end_ns = stop.before_ns


def _levels(message: Message, stop: _Stop) -> bool:
    return isinstance(message, TiltCommand) and message.angle_rad == 0.0 and message.stamp_ns == stop.stamp_ns


@dataclass(slots=True)
class _Lane:
    """The decisions of one topic, as recorded and as replayed.

    `proven` is the least number of them by the other topics: a run is `DONE` once its sample is there.
    """

    recorded: list[Message] = field(default_factory=list[Message])
    replayed: list[Message] = field(default_factory=list[Message])
    decided_ns: list[int] = field(default_factory=list[int])
    end_ns: int = 0
    proven: int = 0

    def decided(self, decision: Message, now_ns: int) -> None:
        """Takes a decision of the replay, and when it was taken."""
        self.replayed.append(decision)
        self.decided_ns.append(now_ns)

    def compare(self) -> tuple[int, Difference | None]:
        """Returns the number of decisions that agree, and the first that does not.

        A recording may end between an input and the decision that follows from it, but not the other way round: it
        holds every decision but those of its last moment, and all that are proven.
        """
        due = max(bisect_left(self.decided_ns, self.end_ns - round(UNRECORDED_S * 1e9)), self.proven)
        pairs = zip_longest(self.recorded, self.replayed[: max(len(self.recorded), due)])
        for number, (recorded, replayed) in enumerate(pairs, start=1):
            if recorded is None or replayed is None or not _equal(recorded, replayed):
                return number - 1, Difference(number, recorded, replayed)
        return len(self.recorded), None


def _known(message: Message | None) -> Message:
    assert message is not None, "a difference has a decision on one of its sides"
    return message


def _stopped(message: Message) -> TypeGuard[RunEvent]:
    return isinstance(message, RunEvent) and message.phase == "ABORTED" and message.reason.startswith(STOPPED)


def _done(message: Message) -> bool:
    return isinstance(message, RunEvent) and message.phase == "DONE"


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
    """Returns true if both are equal, or both nan.

    Floats may differ by rounding, as libraries sum in varying orders. Texts are read `shortened` from a recording.
    """
    if isinstance(one, str) and isinstance(other, str):
        return shortened(one) == shortened(other)
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=_ROUNDING, abs_tol=_ROUNDING) or (math.isnan(one) and math.isnan(other))
    if isinstance(one, tuple) and isinstance(other, tuple):
        return len(one) == len(other) and all(_same(a, b) for a, b in zip(one, other, strict=True))  # pyright: ignore[reportUnknownArgumentType]
    return one == other

"""Decisions that quote a long text are the same in the replay of a recording, which is read without its middle."""

from __future__ import annotations

from typing import Any

from shared import wire
from shared.messages import Message, MotionReport, RunEvent
from station.sampling.actions import Action, Report
from station.sampling.replay import first_of, replay


class Quoting:
    """A machine that quotes each fault that it hears."""

    def handle(self, message: Message, *, now_ns: int) -> list[Action]:
        assert isinstance(message, MotionReport)
        return [Report(RunEvent(stamp_ns=now_ns, run=1, phase="ABORTED", reason=f"the arm said: {message.fault}"))]


def as_recorded(message: Message) -> Message:
    return wire.decode(type(message), wire.encode(message))


def test_a_decision_that_quotes_a_long_text_is_the_same_in_a_replay() -> None:
    machine: Any = Quoting()
    sent = MotionReport(stamp_ns=1, run=1, fault="z" * 10_000)
    heard = as_recorded(sent)
    (decided,) = machine.handle(heard, now_ns=1)
    stream = [("arm/motion", heard, 1), ("session/event", as_recorded(decided.message), 2)]
    assert first_of(replay(machine, stream)) is None
    other = RunEvent(stamp_ns=1, run=1, phase="ABORTED", reason="the arm said: z")
    assert first_of(replay(machine, [*stream[:1], ("session/event", other, 2)])) is not None

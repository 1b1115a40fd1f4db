"""Foxglove's state of an arm's joints."""

from __future__ import annotations

from dataclasses import dataclass

from shared.foxglove import FoxgloveMessage, Timestamp, numbered


@dataclass(frozen=True, slots=True)
class JointState(FoxgloveMessage):
    """A joint's angle in radians.

    The published message has rates and efforts too, which are recorded in `/arm/joints` already. Its position may be
    missing, which protobuf tells from zero; ours never is, so a zero is given as -0.0, which is written.
    """

    name: str = ""
    position: float = numbered(2, -0.0)


@dataclass(frozen=True, slots=True)
class JointStates(FoxgloveMessage):
    """The joints of one moment."""

    timestamp: Timestamp = Timestamp()
    joints: tuple[JointState, ...] = ()

"""The actions that the state machine asks for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from shared.messages import RunEvent, Sample, TiltCommand


@dataclass(frozen=True, slots=True)
class Tilt:
    """Send this command to the arm, and bring back its reply as an ArmReply."""

    command: TiltCommand


@dataclass(frozen=True, slots=True)
class Report:
    """Publish this event or sample."""

    message: RunEvent | Sample


@dataclass(frozen=True, slots=True)
class Say:
    """Write this line to the log."""

    level: Literal["info", "warning", "error"]
    text: str


@dataclass(frozen=True, slots=True)
class Finish:
    """The session is over; `fault` is empty or says why it had to stop."""

    fault: str = ""


Action = Tilt | Report | Say | Finish

"""One part of a verification: how it came out, and where it differs first."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

State = Literal["identical", "different", "not derived"]


@dataclass(frozen=True, slots=True)
class Mismatch:
    """A difference between a recording and what follows from it: topic, stamp (ns), field, and both values.

    `field` is empty, and one value None, where a whole message is missing on one side.
    """

    topic: str
    stamp_ns: int
    field: str
    recorded: Any
    derived: Any

    def __str__(self) -> str:
        """Returns the difference in one line."""
        what = f", {self.field}" if self.field else ""
        return f"/{self.topic} at {self.stamp_ns} ns{what}: recorded {self.recorded}, derived {self.derived}"


@dataclass(frozen=True, slots=True)
class Part:
    """One part: its name, how it came out, how many were compared, in words, and where it differs first."""

    name: str
    state: State
    count: int
    sentence: str
    mismatch: Mismatch | None = None

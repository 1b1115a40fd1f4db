"""A line of the log for each phase and each result; Foxglove and Rerun list them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import ClassVar

from shared.foxglove import LEVELS, Log, Timestamp
from shared.messages import RunEvent, Sample
from shared.rig import RigConfig
from station.recording.viewers.extra import Extra, Handler, foxglove
from station.recording.viewers.state import WITHIN_A_PHASE, result
from station.rig.placed_arm import PlacedArm

TOPIC = "session/log"


class SessionLog:
    """Writes a line of the log for each phase and each result."""

    topics: ClassVar[frozenset[str]] = frozenset({TOPIC})

    def __init__(self, _rig: RigConfig, _arm: PlacedArm) -> None:
        pass

    def handlers(self) -> Mapping[str, Handler]:
        """Returns the handlers of phases and samples."""
        return {"session/event": self._on_event, "session/sample": self._on_sample}

    def _on_event(self, event: RunEvent, stamp_ns: int) -> Iterable[Extra]:
        if event.phase in WITHIN_A_PHASE:
            return
        reason = f": {event.reason}" if event.reason else ""
        yield _line(f"run {event.run}: {event.phase}{reason}", stamp_ns, odd=event.phase == "ABORTED")

    def _on_sample(self, sample: Sample, stamp_ns: int) -> Iterable[Extra]:
        yield _line(result(sample), stamp_ns, odd=sample.disturbed)


def _line(text: str, stamp_ns: int, *, odd: bool) -> Extra:
    level = LEVELS["warning" if odd else "info"]
    return foxglove(TOPIC, Log(Timestamp.from_ns(stamp_ns), level, text, name="session"))

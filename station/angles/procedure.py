"""The comparison as a state machine: what happened goes in, commands and events come out; no clock, no bus, no files.

    WAITING -> (COMMANDED -> MOVING -> SETTLING -> READING) for every stop -> DONE

A fault of the arm ends it in FAILED. A source that says nothing delays no stop for longer than its patience.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

from shared.messages import ArmReply, MotionReport, RunEvent, TiltCommand
from station.angles.plan import DONE_PHASE, READ_PHASE, ComparisonPlan, PlannedStop, planned_stops
from station.angles.settings import SourceName
from station.angles.watch import INFO, WARNING, Note

Output = TiltCommand | RunEvent | Note
_ARMING_NS = 500_000_000
_MOTION_SLACK_S = 20.0


class Phase(Enum):
    """The stage of the comparison."""

    WAITING = "waiting for the sources"
    COMMANDED = "commanded"
    MOVING = "moving"
    SETTLING = "settling"
    READING = "reading"
    DONE = "done"
    FAILED = "failed"


@dataclass(slots=True)
class _Heard:
    """The readings of a source at the present stop."""

    on_demand: bool
    count: int = 0
    last_ns: int = 0
    spoke: bool = False


@dataclass(slots=True)
class _State:
    phase: Phase = Phase.WAITING
    since_ns: int = -1
    index: int = -1
    outputs: list[Output] = field(default_factory=list[Output])


class Procedure:
    """One comparison. Times are the station's clock in nanoseconds."""

    def __init__(self, plan: ComparisonPlan, *, sources: Sequence[SourceName]) -> None:
        self._plan = plan
        self._stops = planned_stops(plan)
        home = PlannedStop(plan.sweeps, self._stops[-1].step + 1, 0.0)
        self._targets = (*self._stops, *([] if plan.way_back else [home]))
        self._heard = {source.name: _Heard(source.on_demand) for source in sources}
        self._state = _State()
        self.failure = ""
        """The reason of an early end, in one sentence; else nothing."""

    @property
    def phase(self) -> Phase:
        """The stage of the comparison."""
        return self._state.phase

    def take_outputs(self) -> list[Output]:
        """Returns the messages that are to be sent since the last call."""
        outputs, self._state.outputs = self._state.outputs, []
        return outputs

    # --- what happens -------------------------------------------------------------------------------------------------

    def on_reading(self, source: str, *, stamp_ns: int) -> None:
        """Takes what a source has read."""
        heard = self._heard.get(source)
        if heard is None:
            return
        heard.spoke = True
        if self.phase is Phase.READING and stamp_ns >= self._state.since_ns:
            heard.count, heard.last_ns = heard.count + 1, stamp_ns

    def on_reply(self, reply: ArmReply | None, *, now_ns: int) -> None:
        """Takes the arm agent's answer to a command, or that nobody has answered."""
        if self.phase is not Phase.COMMANDED:
            return
        if reply is None:
            self._fail("The arm agent did not answer: is `station arm` running with the same rig file?")
        elif not reply.accepted:
            self._fail(f"The arm refused to move: {reply.reason}")
        else:
            self._enter(Phase.MOVING, now_ns)

    def on_motion(self, report: MotionReport, *, now_ns: int) -> None:
        """Takes the arm agent's report of a motion."""
        if self.phase not in (Phase.COMMANDED, Phase.MOVING):
            return
        target = self._targets[self._state.index]
        if report.fault and report.end_ns:
            self._fail(f"The arm stopped at sweep {report.run}, stop {report.step}: {report.fault}")
        elif report.end_ns and (report.run, report.step) == (target.sweep, target.step):
            self._enter(Phase.SETTLING, now_ns)

    def tick(self, now_ns: int) -> None:
        """Takes the present time, with which stops end and limits run out."""
        if self._state.since_ns < 0:
            self._state.since_ns = now_ns
        waited_s = (now_ns - self._state.since_ns) * 1e-9
        if self.phase is Phase.WAITING:
            self._wait_for_sources(now_ns, waited_s)
        elif self.phase is Phase.MOVING and waited_s > self._longest_motion_s():
            self._fail(f"The arm did not report the end of its motion within {waited_s:.0f} s: look at `station arm`")
        elif self.phase is Phase.SETTLING and waited_s >= self._plan.settle_s:
            self._begin_reading(now_ns)
        elif self.phase is Phase.READING and all(self._satisfied(heard, now_ns) for heard in self._heard.values()):
            self._end_reading(now_ns)

    # --- within -------------------------------------------------------------------------------------------------------

    def _enter(self, phase: Phase, now_ns: int) -> None:
        self._state.phase, self._state.since_ns = phase, now_ns

    def _fail(self, why: str) -> None:
        self._state.phase, self.failure = Phase.FAILED, why

    def _longest_motion_s(self) -> float:
        return _MOTION_SLACK_S + 3 * self._plan.to_deg / self._plan.rate_deg_s

    def _wait_for_sources(self, now_ns: int, waited_s: float) -> None:
        """Waits for all that speak by themselves; after `start_s` the comparison begins without the others."""
        quiet = [name for name, heard in self._heard.items() if not heard.spoke and not heard.on_demand]
        if (now_ns - self._state.since_ns < _ARMING_NS) or (quiet and waited_s < self._plan.start_s):
            return
        if len(quiet) == len(self._heard):
            self._fail(f"No angle source has said anything: expected readings from {', '.join(quiet)}")
            return
        if quiet:
            self._say(WARNING, f"The comparison begins without {', '.join(quiet)}: no reading in {waited_s:.0f} s.")
        self._next(now_ns)

    def _next(self, now_ns: int) -> None:
        self._state.index += 1
        if self._state.index == len(self._targets):
            self._enter(Phase.DONE, now_ns)
            return
        target = self._targets[self._state.index]
        rate = math.radians(self._plan.rate_deg_s)
        self._enter(Phase.COMMANDED, now_ns)
        self._state.outputs.append(
            TiltCommand(
                now_ns,
                target.sweep,
                self._plan.direction,
                self._plan.direction * math.pi / 2,
                target.angle_rad,
                target.step,
                rate,
            )
        )

    def _begin_reading(self, now_ns: int) -> None:
        if self._state.index >= len(self._stops):
            self._next(now_ns)
            return
        for heard in self._heard.values():
            heard.count, heard.last_ns = 0, now_ns
        self._enter(Phase.READING, now_ns)
        stop = self._stops[self._state.index]
        self._event(READ_PHASE, now_ns, f"at {math.degrees(stop.angle_rad):.2f} degrees")

    def _satisfied(self, heard: _Heard, now_ns: int) -> bool:
        """Returns true if a source need not be waited for any longer at this stop."""
        wanted = 1 if heard.on_demand else self._plan.readings
        patience_s = self._plan.answer_s if heard.on_demand else self._plan.patience_s
        return heard.count >= wanted or (now_ns - heard.last_ns) * 1e-9 > patience_s

    def _end_reading(self, now_ns: int) -> None:
        self._event(DONE_PHASE, now_ns, "")
        lacking = [name for name, heard in self._heard.items() if not heard.count]
        stop = self._stops[self._state.index]
        if lacking:
            self._say(WARNING, f"Nothing from {', '.join(lacking)} at sweep {stop.sweep}, stop {stop.step}.")
        else:
            self._say(INFO, f"Sweep {stop.sweep}, stop {stop.step}: {math.degrees(stop.angle_rad):.2f} degrees.")
        self._next(now_ns)

    def _event(self, phase: str, now_ns: int, reason: str) -> None:
        stop = self._stops[self._state.index]
        self._state.outputs.append(RunEvent(now_ns, stop.sweep, phase, reason, stop.step))

    def _say(self, level: int, text: str) -> None:
        self._state.outputs.append(Note(level, text))

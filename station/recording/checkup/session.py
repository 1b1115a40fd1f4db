"""Follows what a session went through: phases, runs, samples, clocks, warnings."""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import dataclass

from shared import foxglove
from shared.messages import AgentStatus, ArmLease, ClockOffset, RunEvent, Sample
from station.recording.checkup.held import Held, held_in_a_row
from station.recording.reader import Recorded
from station.recording.summary import is_kept

_LAST_LINES = 20
_WITHIN = frozenset({"SYNC", "STEP_BEGIN", "STEP_END"})
"""The reports besides a run's phases; the sync motion before the first run has such reports as well."""


@dataclass(frozen=True, kw_only=True)
class ClockHealth:
    """One agent's clock against the station's. The spread is between the smallest and the largest offset seen."""

    agent: str
    offset_ms: float
    spread_ms: float
    sigma_ms: float
    rtt_ms: float


@dataclass(frozen=True, kw_only=True)
class SessionHealth:
    """Phases with how often each began; runs, and those before the last that did not end; the last warnings and errors.

    `agent_dropped` is how many frames the camera agent dropped between the first and the last of its reports.
    """

    phases: dict[str, int]
    runs: int
    unended_runs: tuple[int, ...]
    samples: int
    kept: int
    censored: int
    eventless_samples: tuple[int, ...]
    clocks: tuple[ClockHealth, ...]
    agent_dropped: int
    agent_fault: str
    warnings: int
    last_warnings: tuple[str, ...]
    sampleless_runs: tuple[int, ...] = ()
    """Runs that are recorded as done without the sample that they end with."""
    disturbed: tuple[int, ...] = ()
    """Runs whose sample something else than friction had a hand in."""
    owners: tuple[str, ...] = ()
    """The sessions that had the arm, one after another."""
    held: tuple[Held, ...] = ()
    """Runs in a row in which the block did not slip, more of them than chance would hold."""


class SessionWatch:
    """Collects what `SessionHealth` says."""

    def __init__(self) -> None:
        self._phases: Counter[str] = Counter()
        self._ends: dict[int, bool] = {}
        self._done = set[int]()
        self._samples: list[Sample] = []
        self._offsets: dict[str, list[int]] = {}
        self._clock: dict[str, ClockOffset] = {}
        self._dropped: dict[int, tuple[int, int]] = {}
        self._fault = ""
        self._warnings = 0
        self._owners: dict[str, None] = {}
        self._lines: deque[str] = deque(maxlen=_LAST_LINES)

    def add(self, item: Recorded) -> None:
        """Takes the next message of session/event, session/sample, clock, camera/status, arm/lease or log."""
        message = item.message
        if isinstance(message, RunEvent):
            self._phases[message.phase] += 1
            if message.phase == "DONE":
                self._done.add(message.run)
            if message.phase not in _WITHIN:
                self._ends[message.run] = message.phase in ("DONE", "ABORTED")
        elif isinstance(message, Sample):
            self._samples.append(message)
        elif isinstance(message, ClockOffset):
            low, high = self._offsets.get(message.agent, (message.offset_ns, message.offset_ns))
            self._offsets[message.agent] = [min(low, message.offset_ns), max(high, message.offset_ns)]
            self._clock[message.agent] = message
        elif isinstance(message, AgentStatus):
            first, _ = self._dropped.get(message.boot_id, (message.dropped, 0))
            self._dropped[message.boot_id] = (first, message.dropped)
            self._fault = message.fault or self._fault
        elif isinstance(message, ArmLease):
            self._owners.update({message.owner: None} if message.owner else {})
        elif isinstance(message, foxglove.Log) and message.level >= foxglove.LEVELS["warning"]:
            self._warnings += 1
            self._lines.append(f"{message.name}: {message.message}")

    def health(self) -> SessionHealth:
        """Returns the findings of the messages so far."""
        kept = sum(is_kept(sample) for sample in self._samples)
        return SessionHealth(
            phases=dict(self._phases),
            runs=len(self._ends),
            unended_runs=tuple(run for run in list(self._ends)[:-1] if not self._ends[run]),
            samples=len(self._samples),
            kept=kept,
            censored=sum(sample.censored for sample in self._samples),
            eventless_samples=tuple(sample.run for sample in self._samples if sample.run not in self._ends),
            sampleless_runs=tuple(sorted(self._done - {sample.run for sample in self._samples})),
            clocks=tuple(self._clock_health(agent) for agent in sorted(self._clock)),
            agent_dropped=sum(last - first for first, last in self._dropped.values()),
            agent_fault=self._fault,
            warnings=self._warnings,
            last_warnings=tuple(self._lines),
            disturbed=tuple(sample.run for sample in self._samples if sample.disturbed),
            owners=tuple(self._owners),
            held=held_in_a_row(self._samples),
        )

    def _clock_health(self, agent: str) -> ClockHealth:
        last, (low, high) = self._clock[agent], self._offsets[agent]
        return ClockHealth(
            agent=agent,
            offset_ms=last.offset_ns * 1e-6,
            spread_ms=(high - low) * 1e-6,
            sigma_ms=last.sigma_ns * 1e-6,
            rtt_ms=last.rtt_ns * 1e-6,
        )

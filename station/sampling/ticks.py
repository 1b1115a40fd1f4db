"""The tick of a session, its own heartbeat: it begins runs, and ends what has waited too long."""

from __future__ import annotations

from shared.messages import Heartbeat
from station.sampling.frames import ENDING
from station.sampling.outage import Outage
from station.sampling.phases import Phases
from station.sampling.plan import Plan
from station.sampling.timeouts import in_force, not_begun, overdue

_PAUSE_S = 1.0
"""The wait after a fault, before the next run; and of a tick for a frame that would have done the same."""


class Ticks:
    """Does what is due by the time alone."""

    def __init__(self, plan: Plan, phases: Phases) -> None:
        self._plan, self._phases = plan, phases
        self._state, self._tracks = phases.state, phases.tracks
        self._outage = Outage(self._state, self._tracks)

    def tick(self, message: Heartbeat) -> None:
        """Does the one thing that is due now."""
        state = self._state
        state.owner = message.owner
        if state.phase in ENDING and state.since(state.seen_ns) > self._plan.silence_s:
            state.run.disturb("cut")
        if state.phase == "START":
            self._begin()
        elif state.stopped:
            self._end_stopped()
        elif state.phase == "PAUSED":
            self._phases.next_run()
        elif state.phase == "ABORTED":
            if self._is_over():
                self._phases.next_run()
        else:
            self._go_on()

    def _begin(self) -> None:
        state, geometry, attitude = self._state, self._tracks.geometry is not None, bool(self._tracks.attitude_ns)
        # A stop of before is told until this session's first heartbeat has lifted it.
        if geometry and attitude and state.found_ns and not state.stopped:
            self._phases.synchronise()
        elif fault := not_begun(
            state, geometry=geometry, attitude=attitude, untimed=self._tracks.clocks.unknown(now_ns=state.now_ns)
        ):
            state.say("error", fault)
            state.finish(fault)

    def _end_stopped(self) -> None:
        """Ends the session that a stop came upon; a run that its halted motion has ended is not ended again."""
        fault = in_force(self._state.stopped)
        if self._state.phase == "ABORTED":
            self._state.finish(fault)
        else:
            self._state.end(fault)

    def _is_over(self) -> bool:
        """Returns true once the fault that ended the last run is over."""
        state = self._state
        if state.outage:
            return self._outage.over()
        # Longer after each fault in a row: who died may be started again meanwhile.
        return state.waited(_PAUSE_S * 2 ** min(state.faults - 1, 4))

    def _go_on(self) -> None:
        """Gives up the run that waits in vain, or does what no frame has had done."""
        state, slip = self._state, self._plan.slip
        held_s = state.since(state.hold_from_ns)
        if fault := overdue(state):
            state.abort(fault)
        elif state.phase == "TILT" and state.awaited is None and held_s > self._plan.tilt.hold_s:
            self._phases.next_step()
        elif state.phase == "SETTLE" and state.waited(slip.settle_s + _PAUSE_S):
            self._phases.bring_back()
        elif state.phase == "DONE" and state.waited(slip.rest_timeout_s + _PAUSE_S):
            self._phases.conclude()

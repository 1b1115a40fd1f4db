"""The arm's part of a session: its answers to commands, how its motions go, and who has it."""

from __future__ import annotations

from shared.messages import ArmLease, ArmReply, MotionReport
from station.sampling.phases import Phases

OWN_ORDER = -1
"""The run number of motions that the arm makes on its own order."""
_STALE_NS = 500_000_000


class ArmReports:
    """Takes what the arm agent says, and goes on or ends the run by it."""

    def __init__(self, phases: Phases) -> None:
        self._phases = phases
        self._state, self._tracks = phases.state, phases.tracks

    def reply(self, message: ArmReply) -> None:
        """Gives the run up whose command was refused."""
        state = self._state
        if message.accepted or state.awaited != (message.run, message.step):
            return
        if state.phase == "ABORTED":  # levelling while it waits
            state.awaited = None
        else:
            state.abort(message.reason or "the arm refused the command", passing=message.passing)

    def lease(self, message: ArmLease) -> None:
        """Ends the session when another one has the arm: whatever is seen from now on may be caused by that one."""
        state = self._state
        state.stopped = message.stopped
        if state.owner and message.owner and message.owner != state.owner:
            state.end(f"another session ({message.owner}) has taken the arm over")

    def motion(self, message: MotionReport) -> None:
        """Takes the begin or the end of a motion; the awaited one's lets the run go on, or ends it."""
        state = self._state
        if message.run == OWN_ORDER and self._moved_by_itself(message):
            state.abort("the arm moved by itself, because it did not hear the station", passing=True)
            return
        if (message.run, message.step) != state.awaited or self._of_an_earlier_session(message):
            return
        if state.phase == "ABORTED":
            state.awaited = None if message.fault or message.end_ns else state.awaited
        elif message.fault:
            state.abort(message.fault, passing=message.passing)
        elif not message.end_ns:
            state.event("STEP_BEGIN", step=message.step, stamp_ns=message.begin_ns)
            if state.phase == "TILT":
                state.run.began(message)
        else:
            state.event("STEP_END", step=message.step, stamp_ns=message.end_ns)
            state.awaited = None
            self._phases.arrived()

    def _moved_by_itself(self, message: MotionReport) -> bool:
        """Returns true if the arm held or levelled on its own order during this very run."""
        begin_ns = self._began_ns(message)
        running = self._state.phase not in ("START", "ABORTED", "PAUSED")
        return running and begin_ns is not None and begin_ns > self._state.run.start_ns

    def _of_an_earlier_session(self, message: MotionReport) -> bool:
        """Returns true if a report from the arm agent's cache is older than the request for this very motion."""
        begin_ns = self._began_ns(message)
        return begin_ns is not None and begin_ns < self._state.asked_ns - _STALE_NS

    def _began_ns(self, message: MotionReport) -> int | None:
        """Returns when a motion began by the station's clock; None while the arm's is not known."""
        offset_ns = self._tracks.clocks.offset_ns("arm", now_ns=self._state.now_ns)
        return None if offset_ns is None else message.begin_ns + offset_ns

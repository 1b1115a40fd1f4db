"""The sampling logic: a state machine whose only inputs are recorded messages and whose only outputs are actions.

    LEVEL → DWELL → REFERENCE → TILT → SLIP → SETTLE → RETURN → DONE, and again;
    a fault in any of them → ABORTED → the next run's LEVEL.

It has no clock: the time is the receive time of the message at hand, and the station's own heartbeat, which is
recorded like everything else, is its tick. So it runs live, in simulated time, and over a recording, where it must
take the same decisions.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from shared.foxglove import CameraCalibration, Timestamp
from shared.messages import (
    ArmLease,
    ArmReply,
    CameraGeometry,
    ClockOffset,
    Environment,
    Heartbeat,
    MarkerCorners,
    Message,
    MotionReport,
    PlatformState,
    SessionPause,
)
from station.sampling.actions import Action
from station.sampling.outage import Outage
from station.sampling.phases import Phases, Reach
from station.sampling.plan import Plan
from station.sampling.run import Specimen
from station.sampling.state import FROZEN, LATE
from station.sampling.timeouts import in_force, not_begun, overdue

INPUTS = (
    *("camera/corners", "camera/geometry", "camera/calibration", "arm/platform", "arm/motion", "arm/reply"),
    *("session/heartbeat", "session/pause", "clock", "environment", "arm/lease"),
)
"""The topics that the machine listens to; nothing else may influence it."""

_PAUSE_S = 1.0  # wait after a fault, before the next run
_STALE_NS = 500_000_000
OWN_ORDER = -1
"""The run number of motions that the arm makes on its own order."""
SLIDING = ("TILT", "SLIP")
"""The phases whose frames make the onset."""
ENDING = ("SLIP", "SETTLE", "RETURN", "DONE")
"""The phases that go on without frames, because the slip is known; the sample is then marked as disturbed."""

MEASURING = ("REFERENCE", "TILT", *ENDING)
"""The phases whose pixels make one sample: they need one calibration, and one camera."""

_Calibration = CameraGeometry | CameraCalibration


class SamplingMachine:
    """Decides what the rig does next: `handle` takes one message and returns the actions that follow from it."""

    def __init__(
        self, plan: Plan, *, size_px: tuple[int, int], reach: Reach, specimen: Specimen, geometry: CameraGeometry | None
    ) -> None:
        self._plan = plan
        self._phases = Phases(plan, size_px=size_px, reach=reach, specimen=specimen, geometry=geometry)
        self._state, self._tracks = self._phases.state, self._phases.tracks
        self._outage = Outage(self._state, self._tracks)
        self._listening = False
        self._handlers: dict[type[Message], Callable[..., None]] = {
            MarkerCorners: self._on_corners,
            PlatformState: self._on_attitude,
            MotionReport: self._on_motion,
            ArmReply: self._on_reply,
            ArmLease: self._on_lease,
            Heartbeat: self._on_tick,
            ClockOffset: self._on_offset,
            CameraGeometry: self._on_geometry,
            CameraCalibration: self._on_lens,
            Environment: self._on_environment,
            SessionPause: self._on_pause,
        }

    @property
    def phase(self) -> str:
        """The current phase: START, one of shared.messages.PHASES, PAUSED between two runs, or FINISHED."""
        return self._state.phase

    @property
    def samples(self) -> int:
        """The number of runs that have given a sample."""
        return self._state.samples

    @property
    def outage(self) -> str:
        """The fault that the session waits out, level; empty if it does not."""
        return self._state.outage

    def handle(self, message: Message, *, now_ns: int) -> list[Action]:
        """Takes one message, received at `now_ns`, and returns the actions that follow, in order.

        Messages before the first heartbeat of the session are ignored.
        """
        state = self._state
        state.begin(now_ns)
        # Recorder and machine cannot begin to listen at the same moment; from the first heartbeat on both do.
        self._listening = self._listening or isinstance(message, Heartbeat)
        if self._listening and state.phase != "FINISHED":
            handler = self._handlers.get(type(message))
            if handler is not None:
                handler(message)
        return state.actions

    def stop(self, reason: str, *, now_ns: int) -> list[Action]:
        """Ends the session now: the current run is aborted, and the plate goes back to level."""
        state = self._state
        state.begin(now_ns)
        if state.phase != "FINISHED":
            state.event("ABORTED", reason)
            state.level()
            state.finish("")
        return state.actions

    # --- what comes in -----------------------------------------------------------------------------------------------

    def _on_offset(self, message: ClockOffset) -> None:
        """Takes an offset; a run is marked if that clock was set meanwhile: its frames and tilts fell apart."""
        if self._tracks.take_offset(message) and self._state.phase in MEASURING:
            self._state.run.disturb("clock")

    def _on_geometry(self, message: CameraGeometry) -> None:
        geometry = message.if_calibrated()
        self._flag_a_change(self._tracks.geometry, geometry, stamp={"stamp_ns": 0})
        self._tracks.geometry = geometry

    def _on_lens(self, message: CameraCalibration) -> None:
        self._flag_a_change(self._tracks.lens, message, stamp={"timestamp": Timestamp()})
        self._tracks.lens = message

    def _flag_a_change(
        self, before: _Calibration | None, now: _Calibration | None, *, stamp: Mapping[str, Any]
    ) -> None:
        """Marks a run of which a part was measured by another calibration; one that is sent again is the same."""
        if before is None or now is None or self._state.phase not in MEASURING:
            return
        if replace(before, **stamp) != replace(now, **stamp):
            self._state.run.disturb("calibration")

    def _on_environment(self, message: Environment) -> None:
        self._phases.environment = message

    def _on_pause(self, message: SessionPause) -> None:
        """Holds back the next run, or lets it begin at the next tick."""
        state = self._state
        if message.paused != state.paused:
            state.paused = message.paused
            state.say("info", "pausing: no further run begins" if state.paused else "going on")

    def _on_attitude(self, message: PlatformState) -> None:
        state, tracks = self._state, self._tracks
        if not tracks.take_attitude(message, now_ns=state.now_ns, within_s=self._plan.silence_s):
            return
        state.attitude_ns = state.now_ns
        if state.phase == "SLIP" and tracks.attitude_ns >= state.run.detect_ns:
            self._phases.read_slide()

    def _on_corners(self, message: MarkerCorners) -> None:
        state, tracks = self._state, self._tracks
        if message.marker_id:  # another mark's are no corners of the block
            return
        if tracks.is_from_another(message) and state.phase in MEASURING:
            state.run.disturb("two_cameras")
        if tracks.repeats(message):
            state.blind = FROZEN
            return
        found, frame_ns = tracks.take_corners(message), tracks.frame_ns
        if not self._fresh(frame_ns):
            return
        state.seen_ns, state.blind = state.now_ns, ""
        if not found:
            return
        state.found_ns = state.now_ns
        rest_ns = self._phases.rest.add(message.corners_px, capture_ns=frame_ns)
        if state.phase == "DWELL":
            self._phases.dwell(rest_ns)
        elif state.phase == "REFERENCE":
            self._phases.reference(message)
        elif state.phase == "TILT":
            self._phases.watch(message, frame_ns)
        elif state.phase == "SETTLE" and (rest_ns is not None or state.waited(self._plan.slip.settle_s)):
            self._phases.bring_back()
        elif state.phase == "DONE" and (rest_ns is not None or state.waited(self._plan.slip.rest_timeout_s)):
            self._phases.conclude()

    def _fresh(self, frame_ns: int) -> bool:
        """Returns true if a frame shows what is now, by its capture time; an older one is kept, but decides nothing.

        A frame may be as old as corners may stay away (`silence_s`): it is as good as none then.
        """
        state = self._state
        if abs(state.now_ns - frame_ns) <= self._plan.silence_s * 1e9:
            return True
        state.blind = LATE
        if state.phase in SLIDING:
            state.run.disturb("late_frames")
        return False

    def _on_reply(self, message: ArmReply) -> None:
        state = self._state
        if message.accepted or state.awaited != (message.run, message.step):
            return
        if state.phase == "ABORTED":  # levelling while it waits
            state.awaited = None
        else:
            state.abort(message.reason or "the arm refused the command", passing=message.passing)

    def _on_lease(self, message: ArmLease) -> None:
        """Ends the session when another one has the arm: whatever is seen from now on may be caused by that one."""
        state = self._state
        state.stopped = message.stopped
        if state.owner and message.owner and message.owner != state.owner:
            self._end(f"another session ({message.owner}) has taken the arm over")

    def _end(self, fault: str) -> None:
        """Ends the session, and the run under way, without asking anything more of the arm."""
        state = self._state
        state.event("ABORTED", fault)
        state.say("error", f"run {state.run.number} aborted: {fault}")
        state.finish(fault)

    def _end_stopped(self) -> None:
        """Ends the session that a stop came upon; a run that its halted motion has ended is not ended again."""
        fault = in_force(self._state.stopped)
        if self._state.phase == "ABORTED":
            self._state.finish(fault)
        else:
            self._end(fault)

    def _on_motion(self, message: MotionReport) -> None:
        state = self._state
        if message.run == OWN_ORDER and self._moved_by_itself(message):
            state.abort("the arm moved by itself, because it did not hear the station", passing=True)
            return
        if (message.run, message.step) != state.awaited or self._of_an_earlier_session(message):
            return
        self._tracks.attitude_repeats.take_motion(under_way=not (message.end_ns or message.fault))
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
        begin_ns = self._tracks.by_station_ns(message.begin_ns, agent="arm")
        running = self._state.phase not in ("START", "ABORTED", "PAUSED")
        return running and begin_ns is not None and begin_ns > self._state.run.start_ns

    def _of_an_earlier_session(self, message: MotionReport) -> bool:
        """Returns true if a report from the arm agent's cache is older than the request for this very motion."""
        begin_ns = self._tracks.by_station_ns(message.begin_ns, agent="arm")
        return begin_ns is not None and begin_ns < self._state.asked_ns - _STALE_NS

    def _begin(self) -> None:
        state, geometry, attitude = self._state, self._tracks.geometry is not None, bool(self._tracks.attitude_ns)
        # A stop of before is told until this session's first heartbeat has lifted it.
        if geometry and attitude and state.found_ns and not state.stopped:
            self._phases.synchronise()
        elif fault := not_begun(state, geometry=geometry, attitude=attitude):
            state.say("error", fault)
            state.finish(fault)

    def _on_tick(self, message: Heartbeat) -> None:
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
        elif state.phase == "ABORTED" and state.outage:
            if self._outage.over():
                self._phases.next_run()
        elif state.phase == "ABORTED":
            # Longer after each fault in a row: who died may be started again meanwhile.
            if state.waited(_PAUSE_S * 2 ** min(state.faults - 1, 4)):
                self._phases.next_run()
        elif fault := overdue(state):
            state.abort(fault)
        elif (
            state.phase == "TILT" and state.awaited is None and state.since(state.hold_from_ns) > self._plan.tilt.hold_s
        ):
            self._phases.next_step()
        elif state.phase == "SETTLE" and state.waited(self._plan.slip.settle_s + _PAUSE_S):
            self._phases.bring_back()
        elif state.phase == "DONE" and state.waited(self._plan.slip.rest_timeout_s + _PAUSE_S):
            self._phases.conclude()

"""The sampling logic: a state machine whose only inputs are recorded messages and whose only outputs are actions.

    LEVEL → DWELL → REFERENCE → TILT → SLIP → SETTLE → RETURN → DONE, and again;
    a fault in any of them → ABORTED → the next run's LEVEL.

It has no clock: the time is the receive time of the message at hand, and the station's own heartbeat, which is
recorded like everything else, is its tick. So it runs live, in simulated time, and over a recording, where it must
take the same decisions.
"""

from __future__ import annotations

from collections.abc import Callable

from shared.foxglove import CameraCalibration
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
from station.sampling.arm_reports import ArmReports
from station.sampling.frames import MEASURING, Frames
from station.sampling.phases import Phases, Reach
from station.sampling.plan import Plan
from station.sampling.run import Specimen
from station.sampling.ticks import Ticks

INPUTS = (
    *("camera/corners", "camera/geometry", "camera/calibration", "arm/platform", "arm/motion", "arm/reply"),
    *("session/heartbeat", "session/pause", "clock", "environment", "arm/lease"),
)
"""The topics that the machine listens to; nothing else may influence it."""


class SamplingMachine:
    """Decides what the rig does next: `handle` takes one message and returns the actions that follow from it."""

    def __init__(
        self, plan: Plan, *, size_px: tuple[int, int], reach: Reach, specimen: Specimen, geometry: CameraGeometry | None
    ) -> None:
        self._plan = plan
        self._phases = Phases(plan, size_px=size_px, reach=reach, specimen=specimen, geometry=geometry)
        self._state, self._tracks = self._phases.state, self._phases.tracks
        frames, arm, ticks = Frames(plan, self._phases), ArmReports(self._phases), Ticks(plan, self._phases)
        self._listening = self._told_of_air = False
        self._handlers: dict[type[Message], Callable[..., None]] = {
            MarkerCorners: frames.corners,
            PlatformState: self._on_attitude,
            MotionReport: arm.motion,
            ArmReply: arm.reply,
            ArmLease: arm.lease,
            Heartbeat: ticks.tick,
            ClockOffset: self._on_offset,
            CameraGeometry: frames.geometry,
            CameraCalibration: frames.lens,
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
        if self._tracks.clocks.take(message, now_ns=self._state.now_ns) and self._state.phase in MEASURING:
            self._state.run.disturb("clock")

    def _on_environment(self, message: Environment) -> None:
        """Takes a reading of the air; one of another time is told once, as the sensor's clock may be at fault."""
        state = self._state
        if self._phases.air.take(message, now_ns=state.now_ns) or self._told_of_air:
            return
        self._told_of_air = True
        old_s = state.since(message.stamp_ns)
        state.say(
            "warning", f"expected the air (environment) of this moment, got a stamp of {old_s:.0f} s ago: not taken"
        )

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

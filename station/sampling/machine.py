"""The sampling logic: a state machine whose only inputs are recorded messages and whose only outputs are actions.

    LEVEL → DWELL → REFERENCE → TILT → SLIP → SETTLE → RETURN → DONE, and again;
    a fault in any of them → ABORTED → the next run's LEVEL.

It has no clock: the time is the receive time of the message at hand, and the station's own heartbeat, which is
recorded like everything else, is its tick. So it runs live, in simulated time, and over a recording, where it must
take the same decisions.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from shared.messages import (
    ArmReply,
    CameraGeometry,
    ClockOffset,
    Environment,
    Heartbeat,
    MarkerCorners,
    Message,
    MotionReport,
    PlatformState,
    RunEvent,
    TiltCommand,
)
from station.sampling.actions import Action, Finish, Report, Say, Tilt
from station.sampling.angles import AngleRange
from station.sampling.direction import choose
from station.sampling.plan import Plan
from station.sampling.reference import ReferenceReading
from station.sampling.run import Run, Specimen
from station.sampling.slip import RestDetector, slipped
from station.sampling.tracks import Tracks, usable

Reach = Callable[[float], float]
"""The highest tilt (rad) that the arm reaches at an azimuth (rad)."""

INPUTS = (
    *("camera/corners", "camera/geometry", "arm/platform", "arm/motion", "arm/reply"),
    *("session/heartbeat", "clock", "environment"),
)
"""The topics that the machine listens to; nothing else may influence it."""

_TIPPED_FRAMES = 5
_PAUSE_S = 1.0  # after a fault, before the next run
_SYNC_RAD = math.radians(2.0)


class SamplingMachine:
    """Decides what the rig does next. `handle` takes one message and gives the actions that follow from it."""

    def __init__(
        self, plan: Plan, *, size_px: tuple[int, int], reach: Reach, specimen: Specimen, geometry: CameraGeometry | None
    ) -> None:
        self._plan, self._size_px, self._reach, self._specimen = plan, size_px, reach, specimen
        self._rng = np.random.default_rng(plan.seed)
        self._tracks = Tracks(geometry=geometry)
        self._angles = AngleRange(plan.tilt)
        self._handlers: dict[type[Message], Callable[..., None]] = {
            MarkerCorners: self._on_corners,
            PlatformState: self._on_attitude,
            MotionReport: self._on_motion,
            ArmReply: self._on_reply,
            Heartbeat: self._on_tick,
            ClockOffset: self._on_offset,
            CameraGeometry: self._on_geometry,
            Environment: self._on_environment,
        }
        self._actions: list[Action] = []
        self._now_ns = 0
        self._phase = "START"
        self._phase_ns = 0
        self._run = Run(0, 0, 0.0)
        self._awaited: tuple[int, int] | None = None
        self._asked_ns = 0
        self._command = 0
        self._hold_from_ns = 0
        self._rest = RestDetector(plan.slip)
        self._reading = ReferenceReading(plan.reference)
        self._tipped = 0
        self._previous_direction = -1
        self._faults = 0
        self._samples = 0
        self._found_ns = 0
        self._environment: Environment | None = None
        self._sync = 0

    @property
    def phase(self) -> str:
        """The phase it is in: START, one of shared.messages.PHASES, or FINISHED."""
        return self._phase

    @property
    def samples(self) -> int:
        """How many runs have given a sample."""
        return self._samples

    def handle(self, message: Message, *, now_ns: int) -> list[Action]:
        """Takes one message, received at `now_ns`; gives what is to be done, in order."""
        self._actions = []
        self._now_ns = now_ns
        if self._phase != "FINISHED":
            handler = self._handlers.get(type(message))
            if handler is not None:
                handler(message)
        return self._actions

    def stop(self, reason: str, *, now_ns: int) -> list[Action]:
        """Ends the session where it is: the run at hand is aborted, and the plate goes back to level."""
        self._actions = []
        self._now_ns = now_ns
        if self._phase != "FINISHED":
            self._event("ABORTED", reason)
            self._tilt(0.0, rate_deg_s=self._plan.tilt.return_rate_deg_s)
            self._finish("")
        return self._actions

    # --- what comes in -----------------------------------------------------------------------------------------------

    def _on_offset(self, message: ClockOffset) -> None:
        self._tracks.take_offset(message)

    def _on_geometry(self, message: CameraGeometry) -> None:
        self._tracks.geometry = message

    def _on_environment(self, message: Environment) -> None:
        self._environment = message

    def _on_attitude(self, message: PlatformState) -> None:
        self._tracks.take_attitude(message)
        if self._phase == "SLIP" and self._tracks.attitude_ns >= self._run.detect_ns:
            self._average()

    def _on_corners(self, message: MarkerCorners) -> None:
        frame_ns = self._tracks.take_corners(message)
        if not usable(message):
            return
        self._found_ns = self._now_ns
        rest_ns = self._rest.add(message.corners_px, capture_ns=frame_ns)
        if self._phase == "DWELL":
            self._dwell(rest_ns)
        elif self._phase == "REFERENCE":
            self._reference(message)
        elif self._phase == "TILT":
            self._watch(message, frame_ns)
        elif self._phase == "SETTLE" and (
            rest_ns is not None or self._since(self._phase_ns) > self._plan.slip.settle_s
        ):
            self._return()
        elif self._phase == "DONE" and (rest_ns is not None or self._since(self._phase_ns) > self._plan.slip.settle_s):
            self._conclude()

    def _on_reply(self, message: ArmReply) -> None:
        if not message.accepted and self._awaited == (message.run, message.step):
            self._abort(message.reason or "the arm refused the command")

    def _on_motion(self, message: MotionReport) -> None:
        if (message.run, message.step) != self._awaited:
            return
        if message.fault:
            self._abort(message.fault)
        elif not message.end_ns:
            self._event("STEP_BEGIN", step=message.step, stamp_ns=message.begin_ns)
            if self._phase == "TILT":
                self._run.began(message)
        else:
            self._event("STEP_END", step=message.step, stamp_ns=message.end_ns)
            self._awaited = None
            self._arrived()

    def _on_tick(self, _: Heartbeat) -> None:
        if self._phase == "START":
            if self._tracks.geometry is not None and self._tracks.attitude_ns and self._found_ns:
                self._synchronise()
            return
        if self._phase == "ABORTED":
            if self._since(self._phase_ns) > _PAUSE_S:
                self._level()
        elif self._awaited and self._since(self._asked_ns) > self._plan.timeout_s:
            self._abort(f"expected the arm to finish its motion within {self._plan.timeout_s:g} s, it did not")
        elif self._since(self._found_ns) > self._plan.silence_s and self._phase in ("DWELL", "REFERENCE", "TILT"):
            self._abort(f"expected corners of the marker, got none for {self._plan.silence_s:g} s")
        elif self._phase == "DWELL" and self._since(self._phase_ns) > self._plan.timeout_s + self._run.dwell_wanted_s:
            self._abort("expected the block to come to rest on the level plate, it still moves")
        elif (
            self._phase == "TILT" and self._awaited is None and self._since(self._hold_from_ns) > self._plan.tilt.hold_s
        ):
            self._next_step()
        elif self._phase == "SETTLE" and self._waited(self._plan.slip.settle_s + _PAUSE_S):
            self._return()
        elif self._phase == "DONE" and self._waited(self._plan.slip.rest_timeout_s + _PAUSE_S):
            self._conclude()

    # --- phases ------------------------------------------------------------------------------------------------------

    def _synchronise(self) -> None:
        """A small tilt and back, seen by the arm and (by its sag) by the camera: one sync event a session."""
        self._sync += 1
        if self._sync == 1:
            self._enter("SYNC", "a small tilt, seen by arm and camera")
        if self._sync <= 2:
            angle = min(_SYNC_RAD, self._reach(0.0)) if self._sync == 1 else 0.0
            self._tilt(angle, rate_deg_s=self._plan.tilt.rate_deg_s)
        else:
            self._level()

    def _level(self) -> None:
        dwell = math.exp(self._rng.uniform(math.log(self._plan.dwell.min_s), math.log(self._plan.dwell.max_s)))
        direction = self._run.direction
        self._run = Run(self._run.number + 1, self._now_ns, dwell, direction=direction)
        self._command = -1  # the motion to level is step 0, those of the tilt 1 to n, the return n + 1
        self._enter("LEVEL")
        self._tilt(0.0, rate_deg_s=self._plan.tilt.return_rate_deg_s)

    def _dwell(self, rest_ns: int | None) -> None:
        if rest_ns is None:
            return
        self._run.rest_ns = max(rest_ns, self._phase_ns)
        if self._since(self._run.rest_ns) >= self._run.dwell_wanted_s:
            self._reading = ReferenceReading(self._plan.reference)
            self._enter("REFERENCE")

    def _reference(self, message: MarkerCorners) -> None:
        result = self._reading.add(message.corners_px)
        if isinstance(result, str):
            self._say("warning", f"run {self._run.number}: {result}")
            if self._reading.exhausted:
                self._abort(result)
        elif result is not None:
            self._run.reference = result
            self._choose_direction(result.centre_px)

    def _choose_direction(self, centre_px: tuple[float, float]) -> None:
        direction = choose(self._plan.direction, centre_px=centre_px, size_px=self._size_px, rng=self._rng)
        limit = self._reach(direction.azimuth_rad)
        self._run.direction = direction
        self._run.angles_rad = self._angles.steps_rad(direction.sector, limit_rad=limit)
        self._run.tilt_ns = self._now_ns
        self._tipped = 0
        self._enter("TILT", f"direction {direction.number}, azimuth {math.degrees(direction.azimuth_rad):.0f} deg")
        self._next_step()

    def _next_step(self) -> None:
        if self._run.step >= len(self._run.angles_rad):
            self._censor("no slip up to the highest angle")
            return
        self._run.step += 1
        self._command = self._run.step - 1
        self._tilt(self._run.angles_rad[self._run.step - 1], rate_deg_s=self._plan.tilt.rate_deg_s)

    def _watch(self, message: MarkerCorners, frame_ns: int) -> None:
        self._tipped = self._tipped + 1 if message.tipped else 0
        if self._tipped >= _TIPPED_FRAMES:
            self._run.flags.append("tipped")
            self._censor("the block tips over instead of sliding")
        elif not message.tipped and self._slipped(message):
            self._run.detect_ns = frame_ns
            self._event("SLIP", stamp_ns=frame_ns)
            self._phase, self._phase_ns = "SLIP", self._now_ns
        elif self._awaited is None and self._since(self._hold_from_ns) >= self._plan.tilt.hold_s:
            self._next_step()

    def _slipped(self, message: MarkerCorners) -> bool:
        reference = self._run.reference
        return reference is not None and slipped(
            self._plan.slip,
            corners_px=message.corners_px,
            reference_px=reference.corners_px,
            tilt_rad=self._tracks.tilt_rad,
        )

    def _average(self) -> None:
        """The several readings over the 300 ms in which the block began to move, and the onset fitted to the slide."""
        run, tracks = self._run, self._tracks
        run.euler_rad = tracks.mean_euler_rad(from_ns=self._averaged_from_ns(run))
        self._estimate_onset(run)
        self._angles.add(run.direction.sector, run.onset_rad)
        self._enter("SETTLE")

    def _estimate_onset(self, run: Run) -> None:
        beta = run.direction.azimuth_rad
        variance = run.reference.variance_px2 if run.reference else ()
        onset = self._tracks.onset(
            since_ns=max(run.tilt_ns, run.detect_ns - 3_000_000_000),
            detect_ns=run.detect_ns,
            downhill=(math.sin(beta), -math.cos(beta)),
            sigma_px=math.sqrt(sum(variance) / len(variance)) if variance else 1.0,
        )
        if onset is not None:
            run.slip_ns, run.onset_rad, run.onset_sigma_rad = onset.slip_ns, onset.angle_rad, onset.angle_sigma_rad
            return
        # The paper's own number, and the step's width as its uncertainty.
        low, high = run.bracket_rad(run.detect_ns)
        run.onset_rad = self._tracks.mean_tilt_rad(from_ns=self._averaged_from_ns(run))
        run.onset_sigma_rad = (high - low) / math.sqrt(12.0)
        run.flags.append("onset_unresolved")

    def _averaged_from_ns(self, run: Run) -> int:
        return run.detect_ns - round(self._plan.slip.average_s * 1e9)

    def _censor(self, reason: str) -> None:
        run = self._run
        run.censored = True
        run.detect_ns = self._tracks.frame_ns
        run.euler_rad = self._tracks.mean_euler_rad(from_ns=self._hold_from_ns)
        run.onset_rad = self._tracks.tilt_rad
        self._say("info", f"run {run.number}: {reason}; kept as censored")
        self._return()

    def _return(self) -> None:
        self._command = len(self._run.angles_rad)
        self._enter("RETURN")
        self._tilt(0.0, rate_deg_s=self._plan.tilt.return_rate_deg_s)

    def _conclude(self) -> None:
        """Level and at rest again: where the block has come to, and the sample."""
        run = self._run
        sample = run.sample(
            post_corners_px=self._tracks.mean_corners_px(5),
            previous=self._previous_direction,
            specimen=self._specimen,
            geometry=self._tracks.geometry,
            rate_rad_s=math.radians(self._plan.tilt.rate_deg_s),
            environment=self._environment,
        )
        self._previous_direction = run.direction.number
        self._actions.append(Report(sample))
        self._event("DONE")
        self._samples += 1
        self._faults = 0
        if self._samples >= self._plan.samples:
            self._finish("")
        else:
            self._level()

    def _arrived(self) -> None:
        """The motion that was asked for has ended."""
        if self._phase == "SYNC":
            self._synchronise()
        elif self._phase == "LEVEL":
            self._enter("DWELL")
        elif self._phase == "TILT":
            self._hold_from_ns = self._now_ns
        elif self._phase == "RETURN":
            self._phase, self._phase_ns = "DONE", self._now_ns
            self._rest = RestDetector(self._plan.slip)

    def _abort(self, reason: str) -> None:
        self._event("ABORTED", reason)
        self._say("error", f"run {self._run.number} aborted: {reason}")
        self._faults += 1
        self._phase, self._phase_ns, self._awaited = "ABORTED", self._now_ns, None
        if self._faults >= self._plan.faults:
            self._finish(f"{self._faults} runs failed in a row; the last because: {reason}")

    # --- what goes out -----------------------------------------------------------------------------------------------

    def _since(self, stamp_ns: int) -> float:
        return (self._now_ns - stamp_ns) * 1e-9

    def _waited(self, seconds: float) -> bool:
        """Whether the phase has lasted longer than that."""
        return self._since(self._phase_ns) > seconds

    def _enter(self, phase: str, reason: str = "") -> None:
        self._phase, self._phase_ns = phase, self._now_ns
        self._event(phase, reason)

    def _event(self, phase: str, reason: str = "", *, step: int = 0, stamp_ns: int | None = None) -> None:
        stamp = self._now_ns if stamp_ns is None else stamp_ns
        self._actions.append(
            Report(RunEvent(stamp_ns=stamp, run=self._run.number, phase=phase, reason=reason, step=step))
        )

    def _say(self, level: str, text: str) -> None:
        self._actions.append(Say(level, text))  # pyright: ignore[reportArgumentType]

    def _tilt(self, angle_rad: float, *, rate_deg_s: float) -> None:
        self._command += 1
        command = TiltCommand(
            stamp_ns=self._now_ns,
            run=self._run.number,
            direction=self._run.direction.number,
            azimuth_rad=self._run.direction.azimuth_rad,
            angle_rad=angle_rad,
            step=self._command,
            rate_rad_s=math.radians(rate_deg_s),
        )
        self._awaited, self._asked_ns = (command.run, command.step), self._now_ns
        self._actions.append(Tilt(command))

    def _finish(self, fault: str) -> None:
        self._phase, self._phase_ns = "FINISHED", self._now_ns
        self._actions.append(Finish(fault))

"""The phases of a run: what each of them does, and which comes next."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from shared.messages import CameraGeometry, MarkerCorners
from station.sampling.actions import Report
from station.sampling.air import Air
from station.sampling.angles import AngleRange
from station.sampling.direction import Direction, choose
from station.sampling.plan import Plan
from station.sampling.reference import ReferenceReading
from station.sampling.run import Run, Specimen
from station.sampling.slide import mind_braking, read_slide
from station.sampling.slip import RestDetector, slipped, threshold_px
from station.sampling.state import State
from station.sampling.stuck import Asked
from station.sampling.tracks import Tracks

Reach = Callable[[float], float]
"""The largest tilt (rad) that the arm reaches at an azimuth (rad)."""

_TIPPED_FRAMES = 5
_SYNC_RAD = math.radians(2.0)


class Phases:
    """The acts of the state machine: each begins a phase, and the machine decides when."""

    def __init__(
        self, plan: Plan, *, size_px: tuple[int, int], reach: Reach, specimen: Specimen, geometry: CameraGeometry | None
    ) -> None:
        self._plan, self._size_px, self._reach, self._specimen = plan, size_px, reach, specimen
        self._rng = np.random.default_rng(plan.seed)
        self._angles = AngleRange(plan.tilt)
        self._reading = ReferenceReading(plan.reference)
        self._tipped = 0
        self._previous_direction = -1
        self._sync = 0
        self.state = State(plan)
        self.tracks = Tracks(geometry=geometry and geometry.if_calibrated())
        self.rest = RestDetector(plan.slip)
        self.air = Air()

    def synchronise(self) -> None:
        """Makes a small tilt and back, seen by the arm and (by its sag) by the camera: one sync event a session."""
        self._sync += 1
        if self._sync == 1:
            self.state.enter("SYNC", "a small tilt, seen by arm and camera")
        if self._sync <= 2:
            angle = min(_SYNC_RAD, self._reach(0.0)) if self._sync == 1 else 0.0
            self.state.tilt(angle, rate_deg_s=self._plan.tilt.rate_deg_s)
        else:
            self.next_run()

    def next_run(self) -> None:
        """Begins the next run; a session that is paused waits with a level plate instead."""
        state = self.state
        if not state.paused:
            self.level()
        elif state.phase != "PAUSED":
            aborted = state.phase == "ABORTED"  # somewhere in its tilt; other runs have brought the plate back
            state.enter_silently("PAUSED")
            if aborted:
                state.level()

    def level(self) -> None:
        """Begins the next run: the plate goes to level, and the dwell is drawn."""
        state = self.state
        dwell = math.exp(self._rng.uniform(math.log(self._plan.dwell.min_s), math.log(self._plan.dwell.max_s)))
        direction = state.run.direction
        state.run = Run(state.run.number + 1, state.now_ns, dwell, direction=direction, rate_deg_s=self._rate_deg_s())
        state.command = -1  # the motion to level is step 0, those of the tilt 1 to n, the return n + 1
        state.enter("LEVEL")
        state.level()

    def _rate_deg_s(self) -> float:
        rates = self._plan.tilt.rates_deg_s
        return float(self._rng.choice(rates)) if rates else self._plan.tilt.rate_deg_s

    def dwell(self, rest_ns: int | None) -> None:
        """Ends the dwell once the block has rested since `rest_ns` (None: it moves) for the time that was drawn."""
        state = self.state
        if rest_ns is None:
            return
        state.run.rest_ns = max(rest_ns, state.phase_ns)
        if state.since(state.run.rest_ns) >= state.run.dwell_wanted_s:
            self._reading = ReferenceReading(self._plan.reference)
            state.enter("REFERENCE")

    def reference(self, message: MarkerCorners) -> None:
        """Takes a frame for the reference position; a direction follows from it."""
        state = self.state
        result = self._reading.add(message.corners_px)
        if isinstance(result, str):
            state.say("warning", f"run {state.run.number}: {result}")
            if self._reading.exhausted:
                state.abort(result)
        elif result is not None:
            state.run.reference = result
            state.run.measure_scale(self.tracks.off_scale(result.corners_px))
            self._choose_direction(result.centre_px)

    def _choose_direction(self, centre_px: tuple[float, float]) -> None:
        state = self.state
        direction = choose(
            self._plan.direction, centre_px=centre_px, size_px=self._size_px, rng=self._rng, way_px=self._way_px
        )
        limit = self._reach(direction.azimuth_rad)
        state.run.direction, state.run.way_px = direction, self._way_px(direction)
        state.run.angles_rad = self._angles.steps_rad(direction.sector, limit_rad=limit)
        state.run.tilt_ns = state.now_ns
        self._tipped = 0
        state.enter("TILT", f"direction {direction.number}, azimuth {math.degrees(direction.azimuth_rad):.0f} deg")
        self.next_step()

    def _way_px(self, direction: Direction) -> float:
        """Returns how far the foam lets the block slide from its reference, px."""
        reference, specimen = self.state.run.reference, self._specimen
        return self.tracks.way_px(
            reference.corners_px if reference else (),
            specimen.opening,
            side_m=math.sqrt(specimen.block_area_m2),
            azimuth_rad=direction.azimuth_rad,
        )

    def next_step(self) -> None:
        """Goes to the next tilting angle; beyond the last the run is censored."""
        state = self.state
        if state.run.step >= len(state.run.angles_rad):
            self._censor("no slip up to the highest angle")
            if not state.run.disturbed:
                self._angles.add_held()
            return
        state.run.step += 1
        state.command = state.run.step - 1
        state.tilt(state.run.angles_rad[state.run.step - 1], rate_deg_s=state.run.rate_deg_s)

    def watch(self, message: MarkerCorners, frame_ns: int) -> None:
        """Looks at a frame while the plate is being tilted: tipped, slipped, or ready for the next step."""
        state = self.state
        self._tipped = self._tipped + 1 if message.tipped else 0
        if self._tipped >= _TIPPED_FRAMES:
            state.run.flags.append("tipped")
            self._censor("the block tips over instead of sliding")
        elif not message.tipped and self._slipped(message):
            state.run.detect_ns = frame_ns
            state.event("SLIP", stamp_ns=frame_ns)
            state.enter_silently("SLIP")
        elif state.awaited is None and state.since(state.hold_from_ns) >= self._plan.tilt.hold_s:
            self.next_step()

    def _slipped(self, message: MarkerCorners) -> bool:
        reference = self.state.run.reference
        return reference is not None and slipped(
            self._plan.slip,
            corners_px=message.corners_px,
            reference_px=reference.corners_px,
            tilt_rad=self.tracks.tilt_rad,
        )

    def read_slide(self) -> None:
        """Takes the slide's readings, once an attitude after its detection has arrived."""
        state = self.state
        read_slide(state.run, tracks=self.tracks, plan=self._plan.slip)
        self._mind_foam()
        self._mind_encoders(level=False)
        state.enter("SETTLE")

    def _mind_foam(self) -> None:
        run = self.state.run
        run.meet_foam(needed_px=threshold_px(self._plan.slip, tilt_rad=run.onset_rad))

    def _mind_encoders(self, *, level: bool) -> None:
        run = self.state.run
        asked = Asked(
            rate_rad_s=math.radians(run.rate_deg_s),
            return_rad_s=math.radians(self._plan.tilt.return_rate_deg_s),
            reached_rad=run.bracket_rad(run.detect_ns)[0],
            level=level,
        )
        if self.tracks.turning.contradicts(asked, since_ns=run.fitted_from_ns, detect_ns=run.detect_ns):
            run.disturb("encoders")

    def _censor(self, reason: str) -> None:
        state = self.state
        run = state.run
        run.censored = True
        run.detect_ns = self.tracks.frame_ns
        run.euler_rad = self.tracks.mean_euler_rad(from_ns=state.hold_from_ns)
        run.onset_rad = self.tracks.tilt_rad
        self._mind_foam()
        state.say("info", f"run {run.number}: {reason}; kept as censored")
        self.bring_back()

    def bring_back(self) -> None:
        """Sends the plate back to level."""
        state = self.state
        state.command = len(state.run.angles_rad)
        state.enter("RETURN")
        state.level()

    def conclude(self) -> None:
        """Takes the block's final place once it is level and at rest again, and reports the sample."""
        state = self.state
        run = state.run
        # Encoders that were stuck until now tell it by a jump, or by a plate that is not level.
        self._mind_encoders(level=True)
        mind_braking(run, tracks=self.tracks, plan=self._plan.slip, specimen=self._specimen)
        sample = run.sample(
            post_corners_px=self.tracks.mean_corners_px(5),
            previous=self._previous_direction,
            specimen=self._specimen,
            start=self.tracks.pose_of(run.reference.corners_px if run.reference else ()),
            rate_rad_s=math.radians(self.state.run.rate_deg_s),
            environment=self.air.at(run.detect_ns),
        )
        if wrong := sample.impossible():
            state.abort(f"expected a sample that can be measured, got {wrong}: look at the camera's calibration")
            return
        self._previous_direction = run.direction.number
        state.actions.append(Report(sample))
        state.event("DONE")
        if run.disturbed:
            state.say("warning", f"run {run.number} was disturbed ({', '.join(run.flags)}) and does not count")
            state.faults += bool(run.lasting)
        else:
            state.samples += 1
            state.faults = 0
            if not run.censored:
                self._angles.add(run.direction.sector, run.onset_rad)
        if state.samples >= self._plan.samples:
            state.finish("")
        elif run.lasting and state.faults >= self._plan.faults:
            state.finish(f"{state.faults} runs failed in a row; in the last {run.lasting}")
        else:
            self.next_run()

    def arrived(self) -> None:
        """Goes on once the requested motion has ended."""
        state = self.state
        if state.phase == "SYNC":
            self.synchronise()
        elif state.phase == "LEVEL":
            state.enter("DWELL")
        elif state.phase == "TILT":
            state.hold_from_ns = state.now_ns
        elif state.phase == "RETURN":
            state.enter_silently("DONE")
            self.rest = RestDetector(self._plan.slip)

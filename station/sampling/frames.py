"""The camera's part of a session: new frames of the present go to the phase that waits for them.

Frames of another camera, of another calibration, late ones and repeated ones decide nothing; a run that they disturb
says so.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from shared.foxglove import CameraCalibration, Timestamp
from shared.messages import CameraGeometry, MarkerCorners
from station.sampling.phases import Phases
from station.sampling.plan import Plan
from station.sampling.state import FROZEN, LATE, UNTIMED

SLIDING = ("TILT", "SLIP")
"""The phases whose frames make the onset."""
ENDING = ("SLIP", "SETTLE", "RETURN", "DONE")
"""The phases that go on without frames, because the slip is known; the sample is then marked as disturbed."""

MEASURING = ("REFERENCE", "TILT", *ENDING)
"""The phases whose pixels make one sample: they need one calibration, and one camera."""

_Calibration = CameraGeometry | CameraCalibration


class Frames:
    """Takes what the camera sends, and hands it to the phases."""

    def __init__(self, plan: Plan, phases: Phases) -> None:
        self._plan, self._phases = plan, phases
        self._state, self._tracks = phases.state, phases.tracks

    def geometry(self, message: CameraGeometry) -> None:
        """Takes the place of the plate in the picture."""
        geometry = message.if_calibrated()
        self._flag_a_change(self._tracks.geometry, geometry, stamp={"stamp_ns": 0})
        self._tracks.geometry = geometry

    def lens(self, message: CameraCalibration) -> None:
        """Takes the lens's calibration."""
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

    def corners(self, message: MarkerCorners) -> None:
        """Takes the block's corners in a frame."""
        state, tracks = self._state, self._tracks
        if message.marker_id:  # another mark's are no corners of the block
            return
        if tracks.is_from_another(message) and state.phase in MEASURING:
            state.run.disturb("two_cameras")
        if tracks.repeats(message):
            state.blind = FROZEN
            return
        offset_ns = tracks.clocks.offset_ns("camera", now_ns=state.now_ns)
        if offset_ns is None:
            state.blind = UNTIMED
            return
        found, frame_ns = tracks.take_corners(message, offset_ns=offset_ns), tracks.frame_ns
        if not self._fresh(frame_ns):
            return
        state.seen_ns, state.blind = state.now_ns, ""
        if found:
            state.found_ns = state.now_ns
            self._hand_on(message, frame_ns)

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

    def _hand_on(self, message: MarkerCorners, frame_ns: int) -> None:
        """Lets the present phase look at corners that were found."""
        state, slip = self._state, self._plan.slip
        rest_ns = self._phases.rest.add(message.corners_px, capture_ns=frame_ns)
        if state.phase == "DWELL":
            self._phases.dwell(rest_ns)
        elif state.phase == "REFERENCE":
            self._phases.reference(message)
        elif state.phase == "TILT":
            self._phases.watch(message, frame_ns)
        elif state.phase == "SETTLE" and (rest_ns is not None or state.waited(slip.settle_s)):
            self._phases.bring_back()
        elif state.phase == "DONE" and (rest_ns is not None or state.waited(slip.rest_timeout_s)):
            self._phases.conclude()

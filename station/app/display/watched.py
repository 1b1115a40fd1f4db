"""Follows a session on the bus for whoever looks at it: keeps the newest of everything, and works it out when asked."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from shared.bus import Bus, Received
from shared.geometry import mark_scale, tilt_of
from shared.messages import (
    REPLACED,
    AgentStatus,
    ArmLease,
    CameraGeometry,
    ClockOffset,
    MarkerCorners,
    Message,
    MotionReport,
    PlatformState,
    RunEvent,
    Sample,
    SessionPause,
    SessionStatus,
    TiltCommand,
)
from station.app.display import health
from station.app.display.moment import Direction, Health, Moment
from station.rig.tilt import DIRECTIONS, azimuth_of_direction
from station.sampling.plan import Plan
from station.view.reference import ReferenceTracker

TOPICS = (
    *("camera/corners", "camera/status", "camera/geometry", "arm/platform", "arm/command", "arm/motion", "arm/lease"),
    *("session/event", "session/sample", "session/pause", "session/status", "clock"),
)
SILENT_S = 2.0
"""A part that was not heard for longer is said to be silent: camera and arm report many times a second."""
LINES = 4
"""Lines of the log that are kept."""
_CORNERS = 4
"""The corners of a mark."""
_WITHIN_A_PHASE = frozenset({"STEP_BEGIN", "STEP_END", "SYNC"})


class Watched:
    """A session as it is heard on the bus. `attach` it, and ask for the `moment`, on any thread."""

    def __init__(
        self,
        plan: Plan,
        path: Path,
        *,
        nominal_hz: float = 0.0,
        elsewhere: Sequence[Path] = (),
        seconds: Callable[[], float] = time.monotonic,
    ) -> None:
        """`nominal_hz` is the camera's (0: unknown); a recording that is not at `path` is looked for `elsewhere`."""
        self._plan, self._path, self._seconds = plan, path, seconds
        self._nominal_hz, self._elsewhere = nominal_hz, elsewhere
        self._begin = seconds()
        self._newest: dict[type[Message], Message] = {}
        self._heard: dict[type[Message], float] = {}
        self._clocks: dict[str, ClockOffset] = {}
        self._onsets_deg: dict[int, list[float]] = {number: [] for number in range(-1, 4)}
        self._event, self._done = RunEvent(), 0
        self._tilting: TiltCommand | None = None
        self._arm_fault, self._arm_stopped = "", ""
        self._paused = False
        self._reference = ReferenceTracker()
        self._lines: deque[str] = deque(maxlen=LINES)

    def attach(self, bus: Bus) -> None:
        """Listens to the topics that it needs."""
        for topic in TOPICS:
            bus.subscribe(topic, self.take)

    def line(self, level: str, text: str) -> None:
        """Takes a line of the session's log."""
        self._lines.append(text if level == "info" else f"{level}: {text}")

    def take(self, received: Received) -> None:
        """Takes a message of one of the `TOPICS`."""
        message = received.message
        cls = type(message)
        self._newest[cls], self._heard[cls] = message, self._seconds()
        if isinstance(message, MarkerCorners):
            self._reference.on_corners(message)
        elif isinstance(message, RunEvent):
            self._on_event(message)
        elif isinstance(message, Sample):
            self._on_sample(message)
        elif isinstance(message, TiltCommand):
            self._tilting = message if message.angle_rad > 0 else self._tilting
        elif isinstance(message, ClockOffset):
            self._clocks[message.agent] = message
        elif isinstance(message, SessionPause):
            self._paused = message.paused
        elif isinstance(message, SessionStatus):
            self._on_status(message)
        elif isinstance(message, MotionReport):
            self._arm_fault = "" if message.fault == REPLACED else message.fault
        elif isinstance(message, ArmLease):
            self._arm_stopped = f"stopped ({message.stopped})" if message.stopped else ""

    def _on_event(self, event: RunEvent) -> None:
        self._reference.on_event(event)
        if event.phase not in _WITHIN_A_PHASE:
            self._event = event
            self._tilting = None if event.phase == "LEVEL" else self._tilting

    def _on_sample(self, sample: Sample) -> None:
        self._reference.on_sample(sample)
        self._done += 1
        if not sample.censored and not sample.flags:
            self._onsets_deg.setdefault(sample.direction, []).append(math.degrees(sample.onset_angle_rad))

    def _on_status(self, status: SessionStatus) -> None:
        """Learns of a session that was begun elsewhere what its own display knows beforehand."""
        plan, slip = self._plan, self._plan.slip
        if 1 <= status.slip_corners <= _CORNERS and status.slip_base_px > 0 and status.slip_per_deg_px >= 0:
            slip = replace(
                slip, base_px=status.slip_base_px, per_deg_px=status.slip_per_deg_px, corners=status.slip_corners
            )
        self._plan = replace(plan, samples=max(status.total, 1), slip=slip)
        self._paused = status.paused
        if status.recording:
            self._path = self._path.with_name(Path(status.recording).name)
        if status.started_ns:
            self._begin = self._seconds() - 1e-9 * (status.stamp_ns - status.started_ns)

    def moment(self, *, ended: bool = False) -> Moment:
        """Returns the session now; once it has `ended`, a part that is silent is none to worry about."""
        passed_s, tilt_deg = self._seconds() - self._begin, self._tilt_deg()
        moved_px, threshold_px = self._moved_px(), self._threshold_px(tilt_deg)
        if moved_px is None:
            threshold_px = None
        return Moment(
            run=self._event.run,
            phase=self._event.phase or "START",
            direction=None if self._tilting is None else self._tilting.direction,
            azimuth_deg=None if self._tilting is None else math.degrees(self._tilting.azimuth_rad),
            tilt_deg=tilt_deg,
            moved_px=moved_px,
            threshold_px=threshold_px,
            moved_mm=self._mm(moved_px),
            threshold_mm=self._mm(threshold_px),
            done=self._done,
            total=self._plan.samples,
            passed_s=passed_s,
            left_s=passed_s / self._done * (self._plan.samples - self._done) if self._done else None,
            by_direction=tuple(_spread(number, onsets) for number, onsets in self._onsets_deg.items() if onsets),
            health=tuple(self._health(ended=ended)),
            lines=tuple(self._lines.copy()),
            paused=self._paused,
        )

    def _tilt_deg(self) -> float | None:
        state = self._newest.get(PlatformState)
        if not isinstance(state, PlatformState) or not any((state.qw, state.qx, state.qy, state.qz)):
            return None
        return math.degrees(tilt_of(state.qw, state.qx, state.qy, state.qz))

    def _threshold_px(self, tilt_deg: float | None) -> float | None:
        slip = self._plan.slip
        return None if tilt_deg is None else slip.base_px + slip.per_deg_px * tilt_deg

    def _mm(self, size_px: float | None) -> float | None:
        """Returns a length in the picture in mm at the height of the mark, nearer to the camera than the plate."""
        seen = self._newest.get(CameraGeometry)
        if size_px is None or not isinstance(seen, CameraGeometry):
            return None
        if not (seen.mm_per_px > 0 and seen.camera_height_m > seen.mark_height_m >= 0):
            return None
        return size_px * seen.mm_per_px * mark_scale(seen)

    def _moved_px(self) -> float | None:
        """Returns the displacement (px) of the corner with which the slip rule would be fulfilled."""
        corners, reference = self._newest.get(MarkerCorners), self._reference.corners_px
        if reference is None or not isinstance(corners, MarkerCorners) or not corners.found:
            return None
        moved = np.linalg.norm(np.reshape(corners.corners_px, (4, 2)) - reference, axis=1)
        return float(np.sort(moved)[-self._plan.slip.corners])

    # --- health ------------------------------------------------------------------------------------------------------

    def _health(self, *, ended: bool) -> Iterator[Health]:
        status, unheard = self._newest.get(AgentStatus), self._silent(MarkerCorners)
        if unheard:
            yield health.silence("camera", unheard, ended=ended)
        else:
            yield health.camera(status if isinstance(status, AgentStatus) else None, nominal_hz=self._nominal_hz)
        unheard = self._silent(PlatformState)
        # A stop is told once a second while it is in force: one that is told no longer is over, or nobody knows of it.
        fault = ("" if self._silent(ArmLease) else self._arm_stopped) or self._arm_fault
        if unheard and not fault:
            yield health.silence("arm", unheard, ended=ended)
        else:
            yield Health(part="arm", well=not fault, text=fault or "follows")
        yield health.clocks(self._clocks.copy(), ended=ended)
        yield health.disk([self._path, *(folder / self._path.name for folder in self._elsewhere)])

    def _silent(self, cls: type[Message]) -> str:
        if cls not in self._heard:
            return "not heard yet"
        age_s = self._seconds() - self._heard[cls]
        return f"silent for {age_s:.0f} s" if age_s > SILENT_S else ""


def _spread(direction: int, onsets_deg: list[float]) -> Direction:
    sd = float(np.std(onsets_deg, ddof=1)) if len(onsets_deg) > 1 else None
    azimuth_deg = math.degrees(azimuth_of_direction(direction)) if direction in range(DIRECTIONS) else None
    mean = float(np.mean(onsets_deg))
    return Direction(direction=direction, azimuth_deg=azimuth_deg, count=len(onsets_deg), mean_deg=mean, sd_deg=sd)

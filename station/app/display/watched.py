"""Follows a session on the bus for whoever looks at it: keeps the newest of everything, and works it out when asked."""

from __future__ import annotations

import math
import shutil
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from shared.bus import Bus, Received
from shared.geometry import tilt_of
from shared.messages import (
    REPLACED,
    AgentStatus,
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
from station.app.display.moment import Direction, Health, Moment
from station.recording.writer import MIN_FREE_BYTES, partial_path
from station.sampling.plan import Plan
from station.view.reference import ReferenceTracker

TOPICS = (
    *("camera/corners", "camera/status", "arm/platform", "arm/command", "arm/motion"),
    *("session/event", "session/sample", "session/pause", "session/status", "clock"),
)
SILENT_S = 2.0
"""A part that was not heard for longer is said to be silent: camera and arm report many times a second."""
_SOON_FULL = 10
"""Times the room at which a recording stops: from here on the disk needs a look."""
_LINES = 4
_CORNERS = 4
"""The corners of a mark."""
_WITHIN_A_PHASE = frozenset({"STEP_BEGIN", "STEP_END", "SYNC"})


class Watched:
    """A session as it is heard on the bus. `attach` it, and ask for the `moment`, on any thread."""

    def __init__(self, plan: Plan, path: Path, *, seconds: Callable[[], float] = time.monotonic) -> None:
        self._plan, self._path, self._seconds = plan, path, seconds
        self._begin = seconds()
        self._newest: dict[type[Message], Message] = {}
        self._heard: dict[type[Message], float] = {}
        self._clocks: dict[str, ClockOffset] = {}
        self._onsets_deg: dict[int, list[float]] = {number: [] for number in range(-1, 4)}
        self._event, self._direction, self._done, self._arm_fault = RunEvent(), None, 0, ""
        self._paused = False
        self._reference = ReferenceTracker()
        self._lines: deque[str] = deque(maxlen=_LINES)

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
            self._direction = message.direction if message.angle_rad > 0 else self._direction
        elif isinstance(message, ClockOffset):
            self._clocks[message.agent] = message
        elif isinstance(message, SessionPause):
            self._paused = message.paused
        elif isinstance(message, SessionStatus):
            self._on_status(message)
        elif isinstance(message, MotionReport):
            self._arm_fault = "" if message.fault == REPLACED else message.fault

    def _on_event(self, event: RunEvent) -> None:
        self._reference.on_event(event)
        if event.phase not in _WITHIN_A_PHASE:
            self._event = event
            self._direction = None if event.phase == "LEVEL" else self._direction

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

    def moment(self) -> Moment:
        """The session now."""
        passed_s, tilt_deg = self._seconds() - self._begin, self._tilt_deg()
        slip, moved_px = self._plan.slip, self._moved_px()
        shown = moved_px is not None and tilt_deg is not None
        return Moment(
            run=self._event.run,
            phase=self._event.phase or "START",
            direction=self._direction,
            tilt_deg=tilt_deg,
            moved_px=moved_px,
            threshold_px=slip.base_px + slip.per_deg_px * tilt_deg if shown and tilt_deg is not None else None,
            done=self._done,
            total=self._plan.samples,
            passed_s=passed_s,
            left_s=passed_s / self._done * (self._plan.samples - self._done) if self._done else None,
            by_direction=tuple(_spread(number, onsets) for number, onsets in self._onsets_deg.items() if onsets),
            health=tuple(self._health()),
            lines=tuple(self._lines.copy()),
            paused=self._paused,
        )

    def _tilt_deg(self) -> float | None:
        state = self._newest.get(PlatformState)
        if not isinstance(state, PlatformState) or not any((state.qw, state.qx, state.qy, state.qz)):
            return None
        return math.degrees(tilt_of(state.qw, state.qx, state.qy, state.qz))

    def _moved_px(self) -> float | None:
        """The displacement (px) of the corner with which the slip rule would be fulfilled."""
        corners, reference = self._newest.get(MarkerCorners), self._reference.corners_px
        if reference is None or not isinstance(corners, MarkerCorners) or not corners.found:
            return None
        moved = np.linalg.norm(np.reshape(corners.corners_px, (4, 2)) - reference, axis=1)
        return float(np.sort(moved)[-self._plan.slip.corners])

    # --- health ------------------------------------------------------------------------------------------------------

    def _health(self) -> Iterator[Health]:
        yield self._camera()
        yield self._arm()
        clocks = sorted(self._clocks.copy().items())
        told = [f"{agent} {1e-6 * at.offset_ns:+.2f} ± {1e-6 * at.sigma_ns:.2f} ms" for agent, at in clocks]
        yield Health(part="clock", well=bool(told), text=", ".join(told) or "not measured yet")
        yield self._disk()

    def _camera(self) -> Health:
        silent, status = self._silent(MarkerCorners), self._newest.get(AgentStatus)
        if silent or not isinstance(status, AgentStatus):
            return Health(part="camera", well=not silent, text=silent or "no status yet")
        text = f"{status.rate_hz:.1f} frames/s, {status.dropped} dropped"
        warm = f", {status.temperature_c:.0f} °C" if status.temperature_c > 0 else ""  # nan, or never told: unknown
        return Health(part="camera", well=not status.fault, text=status.fault or text + warm)

    def _arm(self) -> Health:
        fault = self._silent(PlatformState) or self._arm_fault
        return Health(part="arm", well=not fault, text=fault or "follows")

    def _disk(self) -> Health:
        free = shutil.disk_usage(self._path.parent).free if self._path.parent.is_dir() else 0
        files = (partial_path(self._path), self._path)
        written = next((file.stat().st_size for file in files if file.exists()), 0)
        text = f"{1e-6 * written:.1f} MB written, {1e-9 * free:.1f} GB free"
        return Health(part="disk", well=free > _SOON_FULL * MIN_FREE_BYTES, text=text)

    def _silent(self, cls: type[Message]) -> str:
        if cls not in self._heard:
            return "not heard yet"
        age_s = self._seconds() - self._heard[cls]
        return f"silent for {age_s:.0f} s" if age_s > SILENT_S else ""


def _spread(direction: int, onsets_deg: list[float]) -> Direction:
    sd = float(np.std(onsets_deg, ddof=1)) if len(onsets_deg) > 1 else None
    return Direction(direction=direction, count=len(onsets_deg), mean_deg=float(np.mean(onsets_deg)), sd_deg=sd)

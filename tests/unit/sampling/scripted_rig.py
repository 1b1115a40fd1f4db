"""A rig made of arithmetic: it obeys the machine's commands in simulated time, and misbehaves when it is told to."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from shared.messages import (
    ArmReply,
    CameraGeometry,
    ClockOffset,
    Heartbeat,
    MarkerCorners,
    Message,
    MotionReport,
    PlatformState,
    RunEvent,
    Sample,
    TiltCommand,
)
from station.sampling.actions import Finish, Report, Say, Tilt
from station.sampling.direction import slide_in_image
from station.sampling.machine import SamplingMachine
from station.sampling.plan import Plan
from station.sampling.run import Specimen

PX_PER_M = 6000.0
TURN_NS = 5_000_000
START_NS = 1_000_000_000
GEOMETRY = CameraGeometry(
    plate_from_pixel=(1 / PX_PER_M, 0, -0.05, 0, -1 / PX_PER_M, 0.05, 0, 0, 1), mm_per_px=1 / 6, marker_side_m=0.01
)


@dataclass
class ScriptedRig:
    """One block with the friction angle `friction_rad` on a plate that follows commands at their rate.

    The hooks change or drop (None) what would be sent: `on_corners(message, rig)`, `on_reply(reply, rig)`,
    `on_motion(report, rig)`, `on_clock(offset, rig)`.
    """

    plan: Plan
    friction_rad: float = 0.3
    reach_rad: float = math.radians(67.5)
    geometry: CameraGeometry = GEOMETRY
    specimen: Specimen = field(default_factory=Specimen)
    on_corners: Callable[[MarkerCorners, ScriptedRig], MarkerCorners | None] = lambda message, _: message
    on_reply: Callable[[ArmReply, ScriptedRig], ArmReply | None] = lambda reply, _: reply
    on_motion: Callable[[MotionReport, ScriptedRig], MotionReport | None] = lambda report, _: report
    on_clock: Callable[[ClockOffset, ScriptedRig], ClockOffset | None] = lambda offset, _: offset
    now_ns: int = START_NS
    tilt_rad: float = 0.0
    place_px: tuple[float, float] = (300.0, 300.0)
    command: TiltCommand | None = None
    commands: list[TiltCommand] = field(default_factory=list[TiltCommand])
    events: list[RunEvent] = field(default_factory=list[RunEvent])
    samples: list[Sample] = field(default_factory=list[Sample])
    lines: list[str] = field(default_factory=list[str])
    owner: str = ""
    arm_away: bool = False
    """Nothing of the arm agent arrives, and nothing arrives there."""
    fault: str | None = None

    def __post_init__(self) -> None:
        """Builds the machine."""
        self.machine = SamplingMachine(
            self.plan,
            size_px=(600, 600),
            reach=lambda _: self.reach_rad,
            specimen=self.specimen,
            geometry=self.geometry,
        )
        self._began = self._azimuth = self._speed = 0.0
        self._frame = 0

    @property
    def moving(self) -> bool:
        """True while the block slides."""
        return self._speed > 0.0

    def phases(self) -> list[str]:
        """The phases so far, without the steps."""
        return [event.phase for event in self.events if not event.phase.startswith("STEP")]

    def run(self, seconds: float, *, until: Callable[[ScriptedRig], bool] = lambda rig: rig.fault is not None) -> None:
        """Lets time pass."""
        end = self.now_ns + int(seconds * 1e9)
        while self.now_ns < end and not until(self):
            self.now_ns += TURN_NS
            self._turn()

    def _turn(self) -> None:
        self._move()
        w, azimuth = math.cos(self.tilt_rad / 2), self._azimuth
        s = math.sin(self.tilt_rad / 2)
        state = PlatformState(self.now_ns, w, s * math.cos(azimuth), s * math.sin(azimuth), 0.0)
        if not self.arm_away:
            self.give(state)
        if self.now_ns // TURN_NS % 2:
            self._see()
        if self.now_ns // TURN_NS % 10 == 0:
            self.give(Heartbeat(self.now_ns, armed=True, owner=self.owner))
        if self.now_ns // TURN_NS % 200 == 10:
            self._tell_clocks()

    def _move(self) -> None:
        step = TURN_NS * 1e-9
        command = self.command
        if command is not None:
            if not self._began:
                self._began = 1.0
                self._motion(command, end_ns=0)
            change = command.rate_rad_s * step
            away = command.angle_rad - self.tilt_rad
            self._azimuth = command.azimuth_rad
            self.tilt_rad += math.copysign(min(abs(away), change), away)
            if abs(away) <= change:
                self.command = None
                self._motion(command, end_ns=self.now_ns)
        moving = self._speed > 0 or self.tilt_rad > self.friction_rad
        pull = 9.81 * (math.sin(self.tilt_rad) - math.tan(self.friction_rad) * math.cos(self.tilt_rad))
        self._speed = max(0.0, self._speed + pull * step) if moving else 0.0
        dx, dy = slide_in_image(self._azimuth)
        x, y = self.place_px
        travel = self._speed * step * PX_PER_M
        if not (10 < x + travel * dx < 590 and 10 < y + travel * dy < 590):
            self._speed = travel = 0.0
        self.place_px = (x + travel * dx, y + travel * dy)

    def _motion(self, command: TiltCommand, *, end_ns: int) -> None:
        report = self.on_motion(MotionReport(self.now_ns, command.run, command.step, self.now_ns, end_ns), self)
        if report is not None:
            self.give(report)

    def _tell_clocks(self) -> None:
        for agent in ("camera", "arm"):
            offset = self.on_clock(ClockOffset(self.now_ns, agent), self)
            if offset is not None:
                self.give(offset)

    def _see(self) -> None:
        self._frame += 1
        x, y = self.place_px
        wobble = 0.02 * (-1) ** self._frame
        corners = (x - 30, y - 30, x + 30 + wobble, y - 30, x + 30, y + 30, x - 30, y + 30 + wobble)
        seen = MarkerCorners(self.now_ns, self._frame, corners, found=True)
        changed = self.on_corners(seen, self)
        if changed is not None:
            self.give(changed)

    def give(self, message: Message) -> None:
        """Hands a message to the machine and does what it says."""
        for action in self.machine.handle(message, now_ns=self.now_ns):
            if isinstance(action, Report):
                (self.events if isinstance(action.message, RunEvent) else self.samples).append(action.message)  # pyright: ignore[reportArgumentType]
            elif isinstance(action, Say):
                self.lines.append(action.text)
            elif isinstance(action, Finish):
                self.fault = action.fault
            else:
                self._obey(action)

    def _obey(self, action: Tilt) -> None:
        command = action.command
        self.commands.append(command)
        reply = self.on_reply(ArmReply(accepted=True, run=command.run, step=command.step), self)
        if self.arm_away:
            reply = ArmReply(reason="no answer", run=command.run, step=command.step, passing=True)
        if reply is not None and reply.accepted:
            self.command, self._began = command, 0.0
        if reply is not None:
            self.give(reply)

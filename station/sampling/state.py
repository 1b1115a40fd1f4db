"""The state machine's state: its phase, what it waits for, and the actions that every phase adds."""

from __future__ import annotations

import math
from typing import Literal

from shared.messages import RunEvent, TiltCommand
from station.sampling.actions import Action, Finish, Report, Say, Tilt
from station.sampling.plan import Plan
from station.sampling.run import Run

FROZEN, LATE, UNTIMED = "frozen", "late", "untimed"
"""The possible fault of frames that arrive."""


class State:
    """The phase, the current run, the awaited motion, and the actions that the present message causes."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.actions: list[Action] = []
        self.now_ns = 0
        self.phase = "START"
        self.phase_ns = 0
        self.run = Run(0, 0, 0.0)
        self.owner = ""
        """The session's name, as its own heartbeat says."""
        self.command = 0
        """The number of the last motion asked for, within its run."""
        self.awaited: tuple[int, int] | None = None
        """Run and number of the motion whose end is awaited."""
        self.asked_ns = 0
        self.angle_rad = 0.0
        """The angle last asked for."""
        self.takes_s = 0.0
        """The duration of the awaited motion at the rate that was asked for."""
        self.hold_from_ns = 0
        self.found_ns = 0
        """The time at which fresh, usable corners were last received, ns."""
        self.seen_ns = 0
        """The time at which a fresh frame was last received, whatever it showed, ns."""
        self.blind = ""
        """The fault of the frames since: nothing came, they were late, the same again, or of a clock unknown."""
        self.attitude_ns = 0
        """The time at which a fresh attitude of the plate was last received, ns."""
        self.faults = 0
        """The number of runs in a row that have failed, without those that an outage ended."""
        self.outage = ""
        """The fault that ended the run and is none of the experiment, if any; the session waits until it is over."""
        self.stopped = ""
        """The reason of the arm's emergency stop in force; empty while none is."""
        self.samples = 0
        self.paused = False
        """True while no further run may begin."""

    def begin(self, now_ns: int) -> None:
        """Clears the actions: a message has come, and nothing follows from it yet."""
        self.actions = []
        self.now_ns = now_ns
        self.phase_ns = self.phase_ns or now_ns

    # --- time --------------------------------------------------------------------------------------------------------

    def since(self, stamp_ns: int) -> float:
        """Returns seconds from a moment until now."""
        return (self.now_ns - stamp_ns) * 1e-9

    def waited(self, seconds: float) -> bool:
        """Returns true if the phase has lasted longer than that."""
        return self.since(self.phase_ns) > seconds

    # --- phases ------------------------------------------------------------------------------------------------------

    def enter(self, phase: str, reason: str = "") -> None:
        """Begins a phase and reports it."""
        self.enter_silently(phase)
        self.event(phase, reason)

    def enter_silently(self, phase: str) -> None:
        """Begins a phase whose report was, or will be, made by itself."""
        self.phase, self.phase_ns = phase, self.now_ns

    @property
    def absent(self) -> str:
        """The parts that send nothing new, in words; empty if all do. A frozen camera sends the same again."""
        silent = self.plan.silence_s
        camera = "new frames of the camera" if self.blind == FROZEN else "the camera agent"
        since_ns = {camera: self.seen_ns, "the arm agent": self.attitude_ns}
        return " and ".join(name for name, stamp_ns in since_ns.items() if self.since(stamp_ns) > silent)

    def abort(self, reason: str, *, passing: bool = False) -> None:
        """Gives the run up; after too many in a row also the session, with the plate sent back to level.

        A `passing` fault was the network's, and what does not come is none of the experiment: neither counts, and the
        session waits until it is over.
        """
        self.event("ABORTED", reason)
        self.say("error", f"run {self.run.number} aborted: {reason}")
        self.awaited = None
        self.enter_silently("ABORTED")
        if passing or self.absent:
            self.outage = reason
            self.say("warning", f"waiting, level, for {self.absent}" if self.absent else f"waiting, level: {reason}")
            return
        self.faults += 1
        if self.faults >= self.plan.faults:
            self.level()
            self.finish(f"{self.faults} runs failed in a row; the last because: {reason}")

    def end(self, fault: str) -> None:
        """Ends the session, and the run under way, without asking anything more of the arm."""
        self.event("ABORTED", fault)
        self.say("error", f"run {self.run.number} aborted: {fault}")
        self.finish(fault)

    def finish(self, fault: str) -> None:
        """Ends the session."""
        self.enter_silently("FINISHED")
        self.actions.append(Finish(fault))

    # --- what goes out -----------------------------------------------------------------------------------------------

    def event(self, phase: str, reason: str = "", *, step: int = 0, stamp_ns: int | None = None) -> None:
        """Reports a moment of the run; `stamp_ns` is its time, if not now."""
        stamp = self.now_ns if stamp_ns is None else stamp_ns
        self.actions.append(
            Report(RunEvent(stamp_ns=stamp, run=self.run.number, phase=phase, reason=reason, step=step))
        )

    def say(self, level: Literal["info", "warning", "error"], text: str) -> None:
        """Writes a line to the log."""
        self.actions.append(Say(level, text))

    def tilt(self, angle_rad: float, *, rate_deg_s: float) -> None:
        """Asks the arm for the next motion and awaits its end."""
        self.command += 1
        command = TiltCommand(
            stamp_ns=self.now_ns,
            run=self.run.number,
            direction=self.run.direction.number,
            azimuth_rad=self.run.direction.azimuth_rad,
            angle_rad=angle_rad,
            step=self.command,
            rate_rad_s=math.radians(rate_deg_s),
            owner=self.owner,
        )
        self.awaited, self.asked_ns = (command.run, command.step), self.now_ns
        self.takes_s, self.angle_rad = abs(angle_rad - self.angle_rad) / command.rate_rad_s, angle_rad
        self.actions.append(Tilt(command))

    def level(self) -> None:
        """Asks the arm to bring the plate back to level."""
        self.tilt(0.0, rate_deg_s=self.plan.tilt.return_rate_deg_s)

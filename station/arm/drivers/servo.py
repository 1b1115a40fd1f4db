"""A servo tilt stage of one or two axes on a serial line (pyserial), with the sketch in deploy/tilt_stage.

`[arm.options]`: `port` (pyserial's URLs, too), `baud`, `answer_timeout_s` (a board starts anew when its port opens),
`level_by_hand` (your word that you put the stage level before each start, for one that cannot measure its angles).

The stage is only read until a motion has passed the gate. Set-points follow each other every 16 ms; `A` (arm) and `S`
(stop) are said until the stage has obeyed, so a damaged line delays and does no more. By itself the stage refuses what
is beyond its own limits or a jump, holds when it hears nothing for half a second, and levels 5 s later. The angles are
those that its sensors measure or, where it has none, those that its servos are told to take.

A board that starts anew (its supply broke down, its plug was loose) takes its plate for level, wherever it stands, and
would throw it there. So it is a new stage, which is greeted again, and `level_by_hand` was said of the one before.
"""

from __future__ import annotations

import numpy as np

from shared.byte_links import open_link
from shared.config import parse
from shared.errors import UserError
from station.arm.drivers import DriverLink, JointReading
from station.arm.drivers import _servo_lines as lines
from station.arm.drivers._servo_greeting import ServoOptions, greeted, new_life, require_fit
from station.arm.trajectory import JointTrajectory

_PERIOD_NS = 15_000_000  # two ticks of the agent: at 115200 baud a set-point of two axes takes 3 ms
_ARMING_NS = 500_000_000
_ASKING_NS = 250_000_000


class ServoStage:
    """A `Driver` for a tilt stage on a serial line."""

    def __init__(self, link: DriverLink) -> None:
        self._model = link.model
        self._options = parse(ServoOptions, link.options)
        self._link = open_link(self._options.port, baud=self._options.baud)
        self._lines = lines.Lines()
        self._report: lines.StageReport | None = None
        self._reading: JointReading | None = None
        self._motion: JointTrajectory | None = None
        self._began_ns = self._said_ns = self._number = 0
        self._followed = self._stopping = self._asking = self._answered = False
        self._fault = ""
        self._life = new_life()
        try:
            hello = greeted(self._link, self._lines, self._options, life=self._life)
            require_fit(hello, self._model, self._options)
        except UserError:
            self._link.close()
            raise
        self._named: int | None = hello.life
        """The name under which the board reports; None of a life that has not been greeted, or was refused."""

    def start(self, trajectory: JointTrajectory, *, now_ns: int) -> None:
        """Begins a motion; the next ticks send its set-points, and arm the stage first if it is not armed."""
        self._motion, self._began_ns, self._fault = trajectory, now_ns, ""
        self._followed = self._stopping = False

    def halt(self, *, now_ns: int) -> None:
        """Stops the stage where it is; it is no longer armed."""
        self._motion, self._stopping = None, True
        self._say(now_ns, "S")

    def tick(self, now_ns: int) -> None:
        """Takes in what the stage says, and sends the next set-point or stop once that is due."""
        self._receive(now_ns)
        if self._asking and now_ns - self._said_ns >= _ASKING_NS:
            self._say(now_ns, "?", self._life)
        if now_ns - self._said_ns < _PERIOD_NS or self._report is None:
            return
        if self._stopping and self._report.state != lines.IDLE:
            self._say(now_ns, "S")
        elif self._motion is not None:
            self._drive(self._motion, self._report.state, now_ns)

    def _drive(self, motion: JointTrajectory, state: str, now_ns: int) -> None:
        """Sends the set-point of this moment, the last one on and on when the motion is over; arms before the first."""
        elapsed_ns = now_ns - self._began_ns
        held = state == lines.HELD and elapsed_ns > motion.duration_ns  # this machine was busy while nothing moved
        if state == lines.FOLLOWING:
            self._followed, self._number = True, self._number + 1
            self._say(now_ns, "T", self._number, *np.rint(motion.at(elapsed_ns)[0] / lines.UNIT_RAD).astype(int))
        elif held or (not self._followed and elapsed_ns < _ARMING_NS):
            self._arm(now_ns)
        else:
            why = lines.MEANING.get(state, f"its state is {state!r}")
            self._give_up(
                f"The tilt stage does not follow: {why}; see that its stop button is free and its cable whole."
            )

    def _arm(self, now_ns: int) -> None:
        """Arms the life that has just reported; a board that is starting reports nothing."""
        if self._answered:
            self._say(now_ns, "A", *([self._named] if self._named else []))
            self._answered = False

    def _say(self, now_ns: int, *words: object) -> None:
        self._said_ns = now_ns
        try:
            self._link.write(lines.line(*words))
        except OSError as gone:
            self._give_up(f"The line to the tilt stage at {self._options.port} is gone ({gone}): check its cable.")

    def _receive(self, now_ns: int) -> None:
        try:
            received = self._lines.take(self._link.read())
        except OSError as gone:
            self._give_up(f"The line to the tilt stage at {self._options.port} is gone ({gone}): check its cable.")
            return
        for words in received:
            if report := lines.stage_report(words, axes=len(self._model.joints)):
                self._take(report, now_ns)
            elif answer := lines.hello(words):
                self._meet(answer)
            elif words[0] == "E" and self._motion is not None:
                self._give_up(f"The tilt stage refuses a set-point: {' '.join(words[1:])}.")

    def _take(self, report: lines.StageReport, now_ns: int) -> None:
        """Takes a report, unless it is of a life that has not been greeted.

        A new life has no name. Where the sketch knows of no names, it has taken fewer set-points than the one before,
        or none, and then it has not moved.
        """
        if self._named is None:
            return
        if report.life != self._named or (self._report is not None and report.number < self._report.number):
            self._report = self._reading = self._motion = None
            self._asking, self._life, self._named = True, new_life(), None
            self._fault = "The board of the tilt stage has started anew: it is asked whether it knows how it stands."
            return
        if self._report is None:
            self._number = report.number  # The last one of an agent before: within one life it only grows.
        self._report, self._answered = report, True
        angles, speeds = (lines.UNIT_RAD * np.array(part, np.float64) for part in (report.angles, report.speeds))
        self._reading = JointReading(now_ns, self._model.joint_names, angles, speeds, np.zeros_like(angles))

    def _meet(self, answer: lines.Hello) -> None:
        """Takes the answer of a new life, for which the promise `level_by_hand` was not made."""
        if not self._asking or answer.life not in (self._life, 0):
            return
        self._asking = False
        if not answer.placed:
            self._fault = (
                f"The board of the tilt stage at {self._options.port} has started anew and does not know how the plate "
                "stands: put it level by hand, and then start the arm agent again."
            )
            return
        try:
            require_fit(answer, self._model, self._options)
            self._fault, self._named = "", answer.life
        except UserError as unfit:
            self._fault = str(unfit)

    def _give_up(self, fault: str) -> None:
        self._fault, self._motion, self._stopping = fault, None, True

    def read(self) -> JointReading | None:
        """Returns the angles and speeds of the stage's latest report; None before the first."""
        return self._reading

    def fault(self) -> str:
        """Returns why the stage does not follow, in one sentence; nothing while it does."""
        return self._fault

    def close(self) -> None:
        """Stops the stage and closes the line: a stopped stage holds for good, whereas a silent one levels."""
        self.halt(now_ns=self._said_ns)
        self._link.close()


def connect(link: DriverLink) -> ServoStage:
    """Opens the serial line and waits for the stage's answer."""
    return ServoStage(link)

"""The arm agent's words on the bus: the arm's state, the motions' begin and end, and lines for the log."""

from __future__ import annotations

from dataclasses import dataclass

from shared.bus import Bus
from shared.foxglove import Log, Timestamp
from shared.messages import JointState, MotionReport, TiltCommand
from station.arm.attitude import Attitude
from station.arm.drivers import JointReading
from station.arm.tilt_path import TiltStage

INFO, WARNING, ERROR = 2, 3, 4


@dataclass(slots=True)
class Moment:
    """The agent's present: its time, ns, and the arm's latest reading (None before the first)."""

    now_ns: int = 0
    reading: JointReading | None = None


class Announcements:
    """Publishes for one agent, whose `moment` it looks at."""

    def __init__(self, bus: Bus, moment: Moment, stage: TiltStage) -> None:
        self._bus, self._moment = bus, moment
        self._attitude = Attitude(stage)
        self._published_ns = -1
        self._said: set[str] = set()

    def state(self) -> None:
        """Publishes joints and attitude of a reading that has not been published yet."""
        reading = self._moment.reading
        if reading is None or reading.stamp_ns <= self._published_ns:
            return
        self._published_ns = reading.stamp_ns
        if self._bus.carries("arm/joints"):
            self._bus.publish("arm/joints", _joint_state(reading))
        self._bus.publish("arm/platform", self._attitude.state(reading))

    def motion(
        self, command: TiltCommand, *, began_ns: int, end_ns: int = 0, fault: str = "", passing: bool = False
    ) -> None:
        """Reports the begin of a command's motion, or its end (`end_ns` is not 0) and why it was an early one."""
        report = MotionReport(self._moment.now_ns, command.run, command.step, began_ns, end_ns, fault, passing)
        self._bus.publish("arm/motion", report)

    def log(self, level: int, text: str) -> None:
        """Writes a line to the log."""
        stamp = Timestamp.from_ns(self._moment.now_ns)
        self._bus.publish("log", Log(timestamp=stamp, level=level, message=text, name="arm"))

    def once(self, text: str) -> None:
        """Warns of what goes on, however often it is told: once until `all_well`."""
        if text not in self._said:
            self._said.add(text)
            self.log(WARNING, text)

    def all_well(self) -> None:
        """Notes that nothing is the matter any more, so that the next warning is a new one."""
        self._said.clear()


def _joint_state(reading: JointReading) -> JointState:
    position, velocity = tuple(reading.position_rad.tolist()), tuple(reading.velocity_rad_s.tolist())
    return JointState(reading.stamp_ns, reading.names, position, velocity, tuple(reading.effort_nm.tolist()))

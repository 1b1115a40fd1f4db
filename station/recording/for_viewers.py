"""Makes what a recording holds for viewers alone, so that plain `rerun FILE.mcap` shows a session from the file itself.

| topic | what | when |
|---|---|---|
| /robot_description | the rig in URDF | once everything that it draws has a place |
| /tf_arm | the arm's links, each in the frame of the one before it | with every /tf, while the arm moves |
| /plate/tilt_deg | the plate's tilt in degrees | as /tf_arm |
| /session/state | run, phase, direction and the last sample in words | when they change |

All of it is made of recorded messages and the rig file; no program of this repository reads it. The messages are ROS
2 ones (see `ros2`), which a reader of `repose` and `foxglove` messages does not know and therefore passes over.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from shared import frames
from shared.config import Table
from shared.errors import UserError
from shared.foxglove import FrameTransforms
from shared.geometry import tilt_of
from shared.messages import JointState, Message, PlatformState, RunEvent, Sample, TiltCommand
from shared.rig import RigConfig, rig_of_table
from station.recording import ros2
from station.rig.description import description
from station.rig.placed_arm import PlacedArm, placed_arm

DESCRIPTION, LINKS, TILT, STATE = "robot_description", "tf_arm", "plate/tilt_deg", "session/state"
TOPICS = frozenset({DESCRIPTION, LINKS, TILT, STATE})
TAKES = frozenset({"arm/joints", "arm/platform", "arm/command", "tf", "session/event", "session/sample"})
"""The topics that it is made of."""
_FINE = 2.0**16
"""Rotations are written in steps of 1 / 65536, finer than `_STILL_RAD`: the 3.3 MB become 2.4 MB."""
_STILL_RAD = 1e-4
"""An arm of a metre is drawn right to a tenth of a millimetre where no joint has moved by more since it was written.

It stands still a third of the time: 40 simulated samples (21.3 MB) take 3.3 MB more with this, 4.4 MB without it
(`station run --lockstep --samples 40 --seed 1`).
"""
_WITHIN_A_PHASE = frozenset({"STEP_BEGIN", "STEP_END", "SYNC"})


@dataclass(frozen=True, slots=True)
class Extra:
    """A message for viewers: its topic, its type and its bytes."""

    topic: str
    type: ros2.Type
    payload: bytes


def for_viewers(rig_toml: str) -> ForViewers | None:
    """The topics for viewers of a recording with this rig file; None without one, or with one that describes no arm."""
    if not rig_toml:
        return None
    try:
        rig = rig_of_table(Table(tomllib.loads(rig_toml)))
        return ForViewers(rig, placed_arm(rig))
    except (UserError, ValueError):  # a session is recorded whatever its rig file says; a wrong TOML is a ValueError
        return None


class ForViewers:
    """Makes the messages for viewers of one session."""

    def __init__(self, rig: RigConfig, arm: PlacedArm) -> None:
        self._rig, self._arm = rig, arm
        self._names = frozenset(arm.model.joint_names)
        self._joints, self._attitude = JointState(), PlatformState()
        self._written: tuple[float, ...] = ()
        self._placed: set[str] = set()
        self._described = False
        self._state = State()

    def follow(self, message: Message, *, stamp_ns: int) -> Iterable[Extra]:
        """The messages that viewers get with a recorded message of a topic in `TAKES`, which happened at `stamp_ns`.

        Raises:
            ArithmeticError: if its numbers make no sense.
        """
        if isinstance(message, JointState):
            self._joints = message
        elif isinstance(message, PlatformState):
            self._attitude = message
        elif isinstance(message, FrameTransforms):
            return self._with_transforms(message, stamp_ns)
        elif self._state.take(message):
            return (Extra(STATE, ros2.STRING, ros2.string(self._state.text())),)
        return ()

    def _with_transforms(self, message: FrameTransforms, stamp_ns: int) -> Iterator[Extra]:
        by_name = dict(zip(self._joints.name, self._joints.position_rad, strict=False))
        if not by_name.keys() >= self._names:
            return  # no joints yet, or those of another arm than the rig file's
        position_rad = tuple(by_name[name] for name in self._arm.model.joint_names)
        if self._moved(position_rad):
            links = list(self._links(position_rad))
            self._written = position_rad
            yield Extra(LINKS, ros2.TRANSFORMS, ros2.transforms(links, stamp_ns=stamp_ns))
            yield Extra(TILT, ros2.NUMBER, ros2.number(round(self._tilt_deg(), 2), stamp_ns=stamp_ns))
        if not self._described:
            yield from self._describe(message)

    def _tilt_deg(self) -> float:
        state = self._attitude
        return math.degrees(tilt_of(state.qw, state.qx, state.qy, state.qz))

    def _moved(self, position_rad: tuple[float, ...]) -> bool:
        pairs = zip(position_rad, self._written, strict=False)
        return not self._written or any(abs(now - then) > _STILL_RAD for now, then in pairs)

    def _links(self, position_rad: tuple[float, ...]) -> Iterator[ros2.Transform]:
        """Every link; the foot too at first, since it stays where it is."""
        steps = self._arm.links(position_rad)
        for step in steps if self._written else (self._arm.foot, *steps):
            yield step.parent, step.child, step.xyz_m, [round(part * _FINE) / _FINE for part in step.quaternion_wxyz]

    def _describe(self, message: FrameTransforms) -> Iterator[Extra]:
        """The description, once every link has a place: viewers report an error for a shape without one."""
        self._placed |= {transform.child_frame_id for transform in message.transforms}
        if self._placed >= {frames.PLATFORM, frames.BLOCK}:
            self._described = True
            yield Extra(DESCRIPTION, ros2.UNREAD_STRING, ros2.string(description(self._rig, self._arm)))


class State:
    """The session's state in words."""

    def __init__(self) -> None:
        self._run, self._phase, self._direction = 0, "", ""
        self._last, self._samples = "", 0

    def take(self, message: Message) -> bool:
        """True if the words change with this message."""
        before = self.text()
        if isinstance(message, RunEvent) and message.phase not in _WITHIN_A_PHASE:
            self._run, self._phase = message.run, message.phase
            if message.phase == "LEVEL":
                self._direction = ""
        elif isinstance(message, TiltCommand) and message.angle_rad > 0:
            self._direction = _direction(message.direction, message.azimuth_rad)
        elif isinstance(message, Sample):
            self._samples += 1
            self._last = _result(message)
        return self.text() != before

    def text(self) -> str:
        """Two lines."""
        present = ", ".join(part for part in (f"Run {self._run}: {self._phase}", self._direction) if part)
        count = "1 sample" if self._samples == 1 else f"{self._samples} samples"
        return f"{present}\n{count}{self._last}"


def _direction(number: int, azimuth_rad: float) -> str:
    azimuth = f"azimuth {math.degrees(azimuth_rad):.0f}°"
    return azimuth if number < 0 else f"direction {number} ({azimuth})"


def _result(sample: Sample) -> str:
    angle = f"{math.degrees(sample.onset_angle_rad):.2f}°"
    outcome = f"no slip up to {angle}" if sample.censored else f"slip at {angle}"
    left_out = f", left out: {', '.join(sample.flags)}" if sample.flags else ""
    return f"; run {sample.run}: {outcome}{left_out}"

"""The angles of the arm's joints as Foxglove's own message, while they change."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import ClassVar

from shared import messages
from shared.foxglove import Timestamp
from shared.foxglove_joints import JointState, JointStates
from shared.rig import RigConfig
from station.recording.viewers.arm_links import moved
from station.recording.viewers.extra import Extra, Handler, Pace, coarse, foxglove
from station.rig.placed_arm import PlacedArm

TOPIC = "arm/joint_states"


class ArmJointStates:
    """Writes the angles of the arm's joints as Foxglove's message, while they change."""

    topics: ClassVar[frozenset[str]] = frozenset({TOPIC})

    def __init__(self, _rig: RigConfig, _arm: PlacedArm) -> None:
        self._pace, self._written = Pace(), tuple[float, ...]()

    def handlers(self) -> Mapping[str, Handler]:
        """Returns the handler of the joint states."""
        return {"arm/joints": self._on_joints}

    def _on_joints(self, message: messages.JointState, stamp_ns: int) -> Iterable[Extra]:
        if not self._pace.due(stamp_ns) or not moved(message.position_rad, self._written):
            return
        self._pace.written(stamp_ns)
        self._written = message.position_rad
        joints = zip(message.name, message.position_rad, strict=False)
        states = tuple(JointState(name, coarse(angle) or -0.0) for name, angle in joints)
        yield foxglove(TOPIC, JointStates(Timestamp.from_ns(stamp_ns), states))

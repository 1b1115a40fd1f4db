"""Makes what a recording holds for viewers alone, so that plain Rerun and Foxglove show a session from the file itself.

Each kind is a file in `viewers`; the table of their topics is in README.md. All of it is made of recorded messages and
the rig file; no program of this repository reads it.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import replace

from shared.config import table_of
from shared.errors import UserError
from shared.messages import Message
from shared.rig import RigConfig, rig_of_table
from station.recording.viewers.annotations import CameraAnnotations
from station.recording.viewers.arm_links import ArmLinks
from station.recording.viewers.extra import Extra, Handler, Kind
from station.recording.viewers.joint_states import ArmJointStates
from station.recording.viewers.log import SessionLog
from station.recording.viewers.robot_description import RobotDescription
from station.recording.viewers.scene import Scene
from station.recording.viewers.state import SessionState
from station.rig.placed_arm import PlacedArm, placed_arm

KINDS: tuple[type[Kind], ...] = (
    ArmLinks,  # before those that draw what it places
    RobotDescription,
    Scene,
    SessionState,
    SessionLog,
    ArmJointStates,
    CameraAnnotations,
)
TOPICS: frozenset[str] = frozenset[str]().union(*(kind.topics for kind in KINDS))


def for_viewers(rig_toml: str, *, own: bool = False) -> ForViewers | None:
    """Returns the topics for viewers of a recording with this rig file.

    It is None without one, or with one that describes no arm.

    Only the user's `own` rig file may name a file as its arm's model.
    """
    if not rig_toml:
        return None
    try:
        rig = rig_of_table(replace(table_of(rig_toml, "rig.toml"), own=own))
        return ForViewers(rig, placed_arm(rig))
    except (UserError, ValueError):  # a session is recorded whatever its rig file says
        return None


class ForViewers:
    """Makes the messages for viewers of one session; `takes` are the topics that they are made of."""

    def __init__(self, rig: RigConfig, arm: PlacedArm) -> None:
        self._handlers: defaultdict[str, list[Handler]] = defaultdict(list)
        for kind in KINDS:
            for topic, handler in kind(rig, arm).handlers().items():
                self._handlers[topic].append(handler)
        self.takes = frozenset(self._handlers)

    def follow(self, topic: str, message: Message, *, stamp_ns: int) -> Iterable[Extra]:
        """Yields the messages for viewers with a recorded message of a topic in `takes`, which happened at `stamp_ns`.

        Raises:
            ArithmeticError: if its numbers make no sense.
        """
        for handler in self._handlers[topic]:
            yield from handler(message, stamp_ns)

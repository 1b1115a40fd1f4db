"""The robot in a bag: its description, its state in words, and a transform of each link of the arm with every /tf.

A recording holds the links only while they move, because a viewer keeps the last; ROS 2 forgets transforms after 10 s.
"""

from __future__ import annotations

from collections.abc import Iterator

from shared.config import table_of
from shared.errors import UserError
from shared.foxglove import FrameTransform, FrameTransforms, Quaternion, Timestamp, Vector3
from shared.messages import JointState
from shared.rig import rig_of_table
from station.recording.for_viewers import for_viewers
from station.recording.reader import Recorded
from station.recording.viewers import robot_description, state
from station.recording.viewers.extra import Extra
from station.rig.placed_arm import PlacedArm, Step, placed_arm


class Robot:
    """Makes what belongs to the robot of the messages of one session; nothing where its rig file describes no arm."""

    def __init__(self, rig_toml: str) -> None:
        self._viewers = for_viewers(rig_toml)
        self._arm = _arm_of(rig_toml)
        self._joints: dict[str, float] = {}
        self._stands = False

    def texts(self, item: Recorded) -> Iterator[Extra]:
        """Yields the description and the state in words, where they are due with this message."""
        if self._viewers is not None and item.topic in self._viewers.takes:
            extras = self._viewers.follow(item.topic, item.message, stamp_ns=item.publish_ns)
            yield from (extra for extra in extras if extra.topic in (robot_description.TOPIC, state.TOPIC))

    def transforms(self, item: Recorded) -> Iterator[tuple[str, FrameTransforms]]:
        """Yields the topic and the transforms of the foot, once, and of the links, with each message of transforms."""
        if isinstance(item.message, JointState):
            self._joints = dict(zip(item.message.name, item.message.position_rad, strict=False))
        if self._arm is None or not isinstance(item.message, FrameTransforms):
            return
        if not self._stands:
            self._stands = True
            yield "/tf_static", _together([self._arm.foot], item.publish_ns)
        if self._joints.keys() >= set(self._arm.model.joint_names):
            angles = [self._joints[name] for name in self._arm.model.joint_names]
            yield "/tf", _together(list(self._arm.links(angles)), item.publish_ns)


def _arm_of(rig_toml: str) -> PlacedArm | None:
    try:
        return placed_arm(rig_of_table(table_of(rig_toml, "rig.toml"))) if rig_toml else None
    except (UserError, ValueError):  # a bag is written whatever the rig file says
        return None


def _together(steps: list[Step], stamp_ns: int) -> FrameTransforms:
    return FrameTransforms(tuple(_transform(step, Timestamp.from_ns(stamp_ns)) for step in steps))


def _transform(step: Step, stamp: Timestamp) -> FrameTransform:
    w, x, y, z = step.quaternion_wxyz
    return FrameTransform(stamp, step.parent, step.child, Vector3(*step.xyz_m), Quaternion(x, y, z, w))

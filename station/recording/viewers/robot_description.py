"""The rig in URDF, once; Rerun draws it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import ClassVar

from shared.foxglove import FrameTransforms
from shared.rig import RigConfig
from station.recording import ros2
from station.recording.viewers.extra import Extra, Handler, ros
from station.recording.viewers.placing import Placing
from station.rig.description import description
from station.rig.placed_arm import PlacedArm

TOPIC = "robot_description"


class RobotDescription:
    """Writes the rig in URDF once everything has been placed."""

    topics: ClassVar[frozenset[str]] = frozenset({TOPIC})

    def __init__(self, rig: RigConfig, arm: PlacedArm) -> None:
        self._rig, self._arm, self._placing = rig, arm, Placing(arm)

    def handlers(self) -> Mapping[str, Handler]:
        """Returns the handlers of joints and transforms, which tell when everything has been placed."""
        return {"arm/joints": self._placing.take_joints, "tf": self._on_transforms}

    def _on_transforms(self, message: FrameTransforms, _: int) -> Iterable[Extra]:
        if self._placing.just_done(message):
            yield Extra(TOPIC, ros(ros2.UNREAD_STRING), ros2.string(description(self._rig, self._arm)))

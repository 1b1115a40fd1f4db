"""The arm's links, each in the frame of the one before it, and the plate's tilt in degrees, while the arm moves."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import ClassVar

from shared.foxglove import FrameTransforms
from shared.geometry import tilt_of
from shared.messages import JointState, PlatformState
from shared.rig import RigConfig
from station.recording import ros2
from station.recording.viewers.extra import Extra, Handler, coarse, ros
from station.rig.placed_arm import PlacedArm

LINKS, TILT = "tf_arm", "plate/tilt_deg"
STILL_RAD = 1e-4
"""An arm of a metre is drawn right to a tenth of a millimetre where no joint has moved by more since it was written.

It stands still a third of the time: 40 simulated samples (21.3 MB) take 3.3 MB more with this, 4.4 MB without it
(`station run --lockstep --samples 40 --seed 1`). Rotations are `coarse`: the 3.3 MB become 2.4 MB.
"""


class ArmLinks:
    """Writes the transforms of the arm's links and the plate's tilt while the arm moves."""

    topics: ClassVar[frozenset[str]] = frozenset({LINKS, TILT})

    def __init__(self, _rig: RigConfig, arm: PlacedArm) -> None:
        self._arm = arm
        self._names = frozenset(arm.model.joint_names)
        self._joints, self._attitude = JointState(), PlatformState()
        self._written: tuple[float, ...] = ()

    def handlers(self) -> Mapping[str, Handler]:
        """Returns the handlers of joints, plate attitude and transforms; only the last writes something."""
        return {"arm/joints": self._on_joints, "arm/platform": self._on_platform, "tf": self._on_transforms}

    def _on_joints(self, message: JointState, _: int) -> tuple[()]:
        self._joints = message
        return ()

    def _on_platform(self, message: PlatformState, _: int) -> tuple[()]:
        self._attitude = message
        return ()

    def _on_transforms(self, _: FrameTransforms, stamp_ns: int) -> Iterable[Extra]:
        by_name = dict(zip(self._joints.name, self._joints.position_rad, strict=False))
        if not by_name.keys() >= self._names:
            return  # no joints yet, or those of another arm than the rig file's
        position_rad = tuple(by_name[name] for name in self._arm.model.joint_names)
        if moved(position_rad, self._written):
            links = list(self._links(position_rad))
            self._written = position_rad
            yield Extra(LINKS, ros(ros2.TRANSFORMS), ros2.transforms(links, stamp_ns=stamp_ns))
            yield Extra(TILT, ros(ros2.NUMBER), ros2.number(round(self._tilt_deg(), 2), stamp_ns=stamp_ns))

    def _tilt_deg(self) -> float:
        state = self._attitude
        return math.degrees(tilt_of(state.qw, state.qx, state.qy, state.qz))

    def _links(self, position_rad: tuple[float, ...]) -> Iterator[ros2.Transform]:
        """Yields every link, and the foot, which stays where it is.

        A viewer that jumps reads the newest message alone.
        """
        foot, steps = self._arm.foot, self._arm.links(position_rad)
        yield foot.parent, foot.child, foot.xyz_m, foot.quaternion_wxyz
        for step in steps:
            yield step.parent, step.child, step.xyz_m, [coarse(part) for part in step.quaternion_wxyz]


def moved(position_rad: tuple[float, ...], written_rad: tuple[float, ...]) -> bool:
    """Returns true if a joint is elsewhere than when it was written last, or nothing was."""
    pairs = zip(position_rad, written_rad, strict=False)
    return not written_rad or any(abs(now - then) > STILL_RAD for now, then in pairs)

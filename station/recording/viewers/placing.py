"""The moment from which everything that is drawn has a place: viewers report an error for a shape without one."""

from __future__ import annotations

from shared import frames
from shared.foxglove import FrameTransforms
from shared.messages import JointState
from station.rig.placed_arm import PlacedArm


class Placing:
    """Follows joints and transforms until arm, plate and block have been placed."""

    def __init__(self, arm: PlacedArm) -> None:
        self._names = frozenset(arm.model.joint_names)
        self._jointed = self._over = False
        self._placed: set[str] = set()

    def take_joints(self, message: JointState, _: int) -> tuple[()]:
        """Notes that the arm's links have a place once the rig file's joints, and not another arm's, have been told."""
        self._jointed = self._jointed or self._names <= frozenset(message.name)
        return ()

    def just_done(self, message: FrameTransforms) -> bool:
        """Returns true once: with the transforms that place what was still missing."""
        if self._over or not self._jointed:
            return False
        self._placed |= {transform.child_frame_id for transform in message.transforms}
        self._over = self._placed >= {frames.PLATFORM, frames.BLOCK}
        return self._over

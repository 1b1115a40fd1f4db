"""Joint states of ROS, in which other publishers of the same topic (a gripper, a lift) may report their joints, too."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shared.errors import UserError
from station.arm.drivers import JointReading, match_joints
from station.rig.arm_model import ArmModel


def joint_reading(
    model: ArmModel,
    names: Sequence[str],
    *,
    stamp_ns: int,
    position_rad: ArrayLike,
    velocity_rad_s: ArrayLike = (),
    effort_nm: ArrayLike = (),
) -> JointReading:
    """Returns the reading in a joint state, whose joints are found by their names every time.

    Args:
        model: the arm, whose joints' order the reading has.
        names: (k,) the joints that the state reports, in any order; those of others are left out.
        stamp_ns: the moment of the reading, ns of the agent's clock.
        position_rad: (k,) their angles, rad.
        velocity_rad_s: (k,) their velocities, rad/s; where the robot sends none, they are zero.
        effort_nm: (k,) their efforts, N m; likewise.

    Raises:
        UserError: if a joint of the model is not among the names, or has no angle: then it is no reading of this arm.
    """
    order = match_joints(model, tuple(names))
    position = np.array(position_rad, dtype=np.float64)
    if position.shape != (len(names),):
        raise UserError(f"Expected an angle for each of {len(names)} joints, got {position.size}.")
    return JointReading(
        stamp_ns, model.joint_names, position[order], _sent(velocity_rad_s, order), _sent(effort_nm, order)
    )


def _sent(values: ArrayLike, order: list[int]) -> NDArray[np.float64]:
    sent = np.array(values, dtype=np.float64)
    return sent[order] if len(sent) > max(order) else np.zeros(len(order))

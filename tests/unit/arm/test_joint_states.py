"""Joint states of ROS are read by name, each for itself, and one without the arm's joints is no reading."""

from __future__ import annotations

import numpy as np
import pytest

from shared.errors import UserError
from station.arm.drivers._joint_states import joint_reading
from station.rig.arm_model import ArmModel


def test_each_state_is_read_in_its_own_order(model: ArmModel) -> None:
    for names in (model.joint_names, ("finger", *model.joint_names[::-1])):
        angles = [10.0 if name == "finger" else model.joint_names.index(name) for name in names]
        reading = joint_reading(model, names, stamp_ns=5, position_rad=angles, velocity_rad_s=np.array(angles) / 10)
        assert reading.stamp_ns == 5
        np.testing.assert_array_equal(reading.position_rad, range(6))
        np.testing.assert_allclose(reading.velocity_rad_s, np.arange(6) / 10)


def test_absent_velocities_and_efforts_are_zero(model: ArmModel) -> None:
    reading = joint_reading(model, model.joint_names, stamp_ns=5, position_rad=model.home_rad)
    np.testing.assert_array_equal(reading.velocity_rad_s, np.zeros(6))
    np.testing.assert_array_equal(reading.effort_nm, np.zeros(6))


@pytest.mark.parametrize("joints", [0, 2, 7])
def test_other_joints_are_no_reading_however_many(model: ArmModel, joints: int) -> None:
    with pytest.raises(UserError, match="j2s6s300_joint_1"):
        joint_reading(model, [f"foreign_{i}" for i in range(joints)], stamp_ns=5, position_rad=np.zeros(joints))


@pytest.mark.parametrize("angles", [0, 5, 7])
def test_joints_without_their_angles_are_no_reading(model: ArmModel, angles: int) -> None:
    with pytest.raises(UserError, match=f"an angle for each of 6 joints, got {angles}"):
        joint_reading(model, model.joint_names, stamp_ns=5, position_rad=np.zeros(angles))

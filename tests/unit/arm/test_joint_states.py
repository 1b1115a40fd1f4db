"""Joint states of ROS are read by name, each for itself, and one without the arm's joints is no reading."""

from __future__ import annotations

import numpy as np
import pytest

from station.arm.drivers._joint_states import JointStates
from station.rig.arm_model import ArmModel


def test_each_state_is_read_in_its_own_order(model: ArmModel) -> None:
    states = JointStates(model)
    for names in (model.joint_names, ("finger", *model.joint_names[::-1])):
        angles = [10.0 if name == "finger" else model.joint_names.index(name) for name in names]
        states.take(names, angles, velocity_rad_s=np.array(angles) / 10, robot_ns=0, noted_ns=5)
        assert states.reading is not None
        assert states.reading.names == model.joint_names
        np.testing.assert_array_equal(states.reading.position_rad, range(6))
        np.testing.assert_allclose(states.reading.velocity_rad_s, np.arange(6) / 10)


def test_absent_efforts_are_zero(model: ArmModel) -> None:
    states = JointStates(model)
    states.take(model.joint_names, model.home_rad, velocity_rad_s=np.zeros(6), robot_ns=0, noted_ns=5)
    assert states.reading is not None
    np.testing.assert_array_equal(states.reading.effort_nm, np.zeros(6))


def test_absent_velocities_are_derived_and_unknown_before(model: ArmModel) -> None:
    """An arm that moves by itself would else rest."""
    states, rate = JointStates(model), 0.2 * np.array([1, -1, 0, 2, 0.5, 0])
    for step in range(30):
        stamp_ns = 10**9 + step * 10_000_000
        angles = np.array(model.home_rad) + rate * step * 0.01
        states.take(model.joint_names, angles, robot_ns=0, noted_ns=stamp_ns)
        if step < 5:
            assert states.reading is None
        else:
            assert states.reading is not None
            np.testing.assert_allclose(states.reading.velocity_rad_s, rate, atol=1e-9)


@pytest.mark.parametrize("joints", [0, 2, 7])
def test_other_joints_are_no_reading_however_many(model: ArmModel, joints: int) -> None:
    names, angles = [f"foreign_{i}" for i in range(joints)], np.full(joints, 0.1)
    states = JointStates(model)
    states.take(names, angles, robot_ns=0, noted_ns=5)
    assert states.reading is None
    assert "j2s6s300_joint_1" in states.fault()
    states.take(model.joint_names, model.home_rad, velocity_rad_s=np.zeros(6), robot_ns=0, noted_ns=6)
    read = states.reading
    assert read is not None
    states.take(names, angles, robot_ns=0, noted_ns=7)
    assert states.reading is read
    assert states.fault() == ""


@pytest.mark.parametrize("angles", [0, 5, 7])
def test_joints_without_their_angles_are_no_reading(model: ArmModel, angles: int) -> None:
    states = JointStates(model)
    states.take(model.joint_names, np.zeros(angles), robot_ns=0, noted_ns=5)
    assert states.reading is None
    assert f"an angle for each of the 6 joints that the arm reports, got {angles}" in states.fault()


def test_another_publishers_clock_is_not_the_arms(model: ArmModel) -> None:
    states = JointStates(model)
    assert states.robot_ns(0) is None
    states.take(model.joint_names, model.home_rad, robot_ns=1_000, noted_ns=5_000)
    states.take(["finger"], [0.02], robot_ns=10**18, noted_ns=6_000)
    assert states.robot_ns(7_000) == 3_000

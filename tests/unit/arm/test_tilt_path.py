"""Tilting about the pivot: how far the home pose reaches, and what the block feels."""

import math
from dataclasses import replace

import numpy as np
import pytest

from shared.errors import UserError
from station.arm.kinematics import pivot_pose
from station.arm.tilt_path import TiltStage, tilt_path, tilt_stage
from station.arm.trajectory import TiltLimits, TiltState, plan_tilt
from station.rig.arm_model import ArmModel, forward_kinematics
from station.rig.tilt import tilt_rotation


@pytest.mark.parametrize("azimuth_deg", range(0, 360, 15))
def test_the_home_pose_reaches_the_paper_s_angle_at_every_azimuth(stage: TiltStage, azimuth_deg: int) -> None:
    path = tilt_path(stage, azimuth_rad=math.radians(azimuth_deg))
    assert math.degrees(path.reach_rad) == pytest.approx(67.5)


@pytest.mark.parametrize("azimuth_deg", [0, 90, 180, 270, 37])
def test_the_pivot_rests_and_the_plate_tilts_as_commanded(stage: TiltStage, azimuth_deg: int) -> None:
    azimuth = math.radians(azimuth_deg)
    path = tilt_path(stage, azimuth_rad=azimuth)
    angles = np.linspace(0, path.reach_rad, 301)  # between the knots too
    poses = pivot_pose(stage.model, path.at(angles)[0])
    np.testing.assert_allclose(poses[:, :3, 3] - stage.pivot_m, 0, atol=1e-6)
    expected = [tilt_rotation(angle, azimuth_rad=azimuth) for angle in angles]
    np.testing.assert_allclose(poses[:, :3, :3], expected, atol=2e-6)


def test_the_slope_is_the_derivative_of_the_joints(stage: TiltStage) -> None:
    path = tilt_path(stage, azimuth_rad=0.4)
    angles = np.linspace(0.01, path.reach_rad - 0.01, 50)
    ahead, behind = path.at(angles + 1e-5)[0], path.at(angles - 1e-5)[0]
    np.testing.assert_allclose(path.at(angles)[1], (ahead - behind) / 2e-5, atol=1e-4)


def block_acceleration(stage: TiltStage, *, angle_rad: float) -> float:
    """The largest linear acceleration in m/s^2 of a point 5 mm above the plate's centre during one tilt."""
    path = tilt_path(stage, azimuth_rad=math.pi / 2)
    motion = plan_tilt(stage.model, path, start=TiltState(), angle_rad=angle_rad, rate_rad_s=0.2, limits=TiltLimits())
    times = np.arange(0, motion.trajectory.duration_ns, 2_000_000)
    joints = [motion.trajectory.at(int(time))[0] for time in times]
    block = stage.model.flange_from_plate @ np.array([0, 0, 0.005, 1])
    places = np.array([(forward_kinematics(stage.model, q) @ block)[:3] for q in joints])
    return float(np.abs(np.diff(places, n=2, axis=0)).max() / 0.002**2)


def test_the_block_feels_no_acceleration_with_the_pivot_in_its_centre_and_some_without(model: ArmModel) -> None:
    def at(pivot_above_plate_m: float) -> TiltStage:
        moved = replace(model, pivot_above_plate_m=pivot_above_plate_m)
        return tilt_stage(moved, base_xyz_m=(0, 0, 0), base_yaw_rad=0, home_rad=model.home_rad)

    assert block_acceleration(at(0.005), angle_rad=0.3) < 2e-3
    assert (
        block_acceleration(at(-0.16), angle_rad=0.3) > 0.05
    )  # turning about the last joint, as without the paper's step


def test_a_joint_limit_ends_the_path_and_is_named(model: ArmModel) -> None:
    narrow = replace(model, joints=(*model.joints[:1], replace(model.joints[1], lower_rad=2.7), *model.joints[2:]))
    stage = tilt_stage(narrow, base_xyz_m=(0, 0, 0), base_yaw_rad=0, home_rad=model.home_rad)
    path = tilt_path(stage, azimuth_rad=math.pi * 3 / 2)
    assert path.reach_rad < math.radians(60)
    assert "joint_2 is at its lower limit" in path.limit
    with pytest.raises(UserError, match=r"out of reach.*joint_2"):
        plan_tilt(narrow, path, start=TiltState(), angle_rad=1.1, rate_rad_s=0.1, limits=TiltLimits())


def test_a_base_elsewhere_moves_the_pivot_and_turns_the_axes(model: ArmModel) -> None:
    turned = tilt_stage(model, base_xyz_m=(0.1, -0.2, 0.3), base_yaw_rad=0.0, home_rad=model.home_rad)
    np.testing.assert_allclose(turned.pivot_m, (0.44, -0.2, 1.08), atol=1e-6)


def test_a_home_pose_that_is_not_level_is_refused(model: ArmModel) -> None:
    crooked = np.add(model.home_rad, (0, 0, 0, 0, 0.3, 0))
    with pytest.raises(UserError, match="does not hold the plate level"):
        tilt_stage(model, base_xyz_m=(0, 0, 0), base_yaw_rad=0, home_rad=crooked)
    with pytest.raises(UserError, match="5 angles"):
        tilt_stage(model, base_xyz_m=(0, 0, 0), base_yaw_rad=0, home_rad=model.home_rad[:5])

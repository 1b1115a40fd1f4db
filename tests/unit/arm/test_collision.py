"""Collisions by MuJoCo's geometry: what touches is found and named, what holds the arm is weighed."""

import math
from dataclasses import replace

import numpy as np
import pytest

from station.arm.collision import CollisionScene
from station.arm.tilt_path import TiltStage, tilt_path, tilt_stage
from station.arm.tilter import Tilter
from station.rig.arm_model import ArmModel, link_transforms
from station.rig.arm_settings import ArmSettings, ObstacleSettings


def scene(stage: TiltStage, **obstacles: object) -> CollisionScene:
    settings = ObstacleSettings(**obstacles)  # pyright: ignore[reportArgumentType] - each test gives one field
    return CollisionScene(stage.model, world_from_base=stage.world_from_base, obstacles=settings)


def test_the_home_pose_is_clear_and_its_nearest_parts_are_named(stage: TiltStage) -> None:
    nearest = scene(stage).clearance(stage.home_rad)
    assert 0.01 < nearest.distance_m < 0.1
    assert nearest.parts == "link 3 and link 6"


def test_a_table_that_is_too_high_is_named_with_its_distance(stage: TiltStage) -> None:
    high = scene(stage, table_m=0.22, clearance_m=0.03)
    shoulder = link_transforms(stage.model, stage.home_rad)[1, 2, 3]
    nearest = high.clearance(stage.home_rad)
    assert nearest.parts == "the table and link 2"
    assert nearest.distance_m == pytest.approx(shoulder - 0.04 - 0.22, abs=1e-6)  # the upper arm's radius is 40 mm
    assert high.touching(stage.home_rad) == "the table and link 2 come within 15 mm of each other (30 are wanted)"


def test_a_wall_in_the_way_ends_the_path_where_the_arm_meets_it(stage: TiltStage) -> None:
    wall = scene(stage, walls_m=((0.34, 0.25, 0.6, 0.6, 0.02, 0.6),))
    free = tilt_path(stage, azimuth_rad=0.0)
    path = tilt_path(stage, azimuth_rad=0.0, touching=wall.touching)
    assert 0.1 < path.reach_rad < free.reach_rad
    assert "wall 1" in path.limit
    assert "mm of each other" in path.limit


def test_the_camera_s_mount_may_be_what_touches(stage: TiltStage) -> None:
    tall = scene(stage, camera_height_m=0.1, camera_size_m=(1.0, 0.3, 0.03))
    path = tilt_path(stage, azimuth_rad=math.pi * 3 / 2, touching=tall.touching)
    assert "the camera" in path.limit
    assert "the camera" not in tilt_path(stage, azimuth_rad=math.pi * 3 / 2, touching=scene(stage).touching).limit


def test_an_arm_folded_into_itself_is_found(stage: TiltStage) -> None:
    folded = stage.home_rad.copy()
    folded[2] = math.radians(20)
    assert scene(stage).clearance(folded).distance_m < 0.0


def test_the_holding_torque_is_gravity_times_lever(stage: TiltStage, model: ArmModel) -> None:
    """The torque is compared with a sum over the links by hand: masses at the middles of the capsules."""
    arm = scene(stage, camera_height_m=0.0)
    measured = arm.holding_torque_nm(stage.home_rad)
    links = link_transforms(model, stage.home_rad)
    expected = np.zeros(6)
    bodies = [(k, joint.link_mass_kg, joint.link_capsule) for k, joint in enumerate(model.joints)]
    for k, mass, capsule in bodies:
        middle = links[k] @ np.array([*(np.add(capsule.from_m, capsule.to_m) / 2), 1.0])
        expected += _torque(links, k, mass=mass, place=middle[:3])
    plate = (links[5] @ model.last_from_flange @ model.flange_from_plate @ np.array([0, 0, -0.003, 1]))[:3]
    expected += _torque(links, 5, mass=0.05, place=plate)
    np.testing.assert_allclose(measured, expected, atol=1e-6)


def _torque(links: np.ndarray, last: int, *, mass: float, place: np.ndarray) -> np.ndarray:
    torque = np.zeros(6)
    for k in range(last + 1):
        torque[k] = links[k, :3, 2] @ np.cross(place - links[k, :3, 3], (0, 0, mass * 9.81))
    return torque


def test_the_agent_s_own_paths_heed_the_obstacles() -> None:
    walled = ObstacleSettings(walls_m=((0.34, 0.25, 0.6, 0.6, 0.02, 0.6),))
    tilter = Tilter.from_settings(replace(ArmSettings(), obstacles=walled))
    assert "wall 1" in tilter.path(0.0).limit
    assert math.degrees(Tilter.from_settings(ArmSettings()).path(0.0).reach_rad) == pytest.approx(67.5)


def test_the_curved_wrist_s_home_pose_reaches_what_it_should() -> None:
    tilter = Tilter.from_settings(ArmSettings(model="jaco2_curved"))
    reach = [math.degrees(tilter.path(direction * math.pi / 2).reach_rad) for direction in range(4)]
    np.testing.assert_allclose(reach, (67.5, 67.5, 60.6, 61.5), atol=0.2)


def test_a_base_turned_with_its_home_pose_leaves_the_world_s_axes(model: ArmModel) -> None:
    turned_home = np.array(model.home_rad)
    turned_home[0] += 0.3  # JACO's first joint turns against the base's z
    stage = tilt_stage(model, base_xyz_m=(0, 0, 0), base_yaw_rad=0.3, home_rad=turned_home)
    np.testing.assert_allclose(stage.pivot_m, (0.34, 0, 0.78), atol=1e-6)

"""Every arm model in station/rig/models is level and clear at home, can tilt, and is written as it is read."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from station.arm.collision import CollisionScene
from station.arm.planning import assess
from station.arm.tilter import settled_stage
from station.arm.urdf.written import toml_of
from station.rig.arm_model import MODELS, ArmModel, load_arm_model
from station.rig.arm_settings import ArmSettings, ObstacleSettings
from station.rig.tilt import DIRECTIONS, azimuth_of_direction

PATHS = sorted(MODELS.glob("*.toml"))


@pytest.fixture(params=PATHS, ids=lambda path: path.stem)
def model(request: pytest.FixtureRequest) -> ArmModel:
    return load_arm_model(request.param)


def test_it_stands_level_at_home_touches_nothing_and_tilts_where_a_session_may(model: ArmModel) -> None:
    stage = settled_stage(ArmSettings(), model)
    scene = CollisionScene(model, world_from_base=stage.world_from_base, obstacles=ObstacleSettings())
    assert scene.touching(stage.home_rad) == ""
    pose = assess(stage, scene=scene, azimuths_rad=[azimuth_of_direction(number) for number in range(DIRECTIONS)])
    steepest = max(pose.reaches, key=lambda reach: reach.angle_rad)
    assert math.degrees(steepest.angle_rad) > 60
    assert steepest.torque_share < 1


def test_its_name_and_source_and_its_joints_names_are_said(model: ArmModel) -> None:
    assert model.name
    assert model.source
    assert len(set(model.joint_names)) == len(model.joints)


def test_written_by_us_it_is_the_same_arm(model: ArmModel, tmp_path: Path) -> None:
    path = tmp_path / "again.toml"
    path.write_text(toml_of(model, notes={}, about=()), encoding="utf-8")
    again = load_arm_model(path)
    for name in ("lower_rad", "upper_rad", "max_velocity_rad_s", "max_acceleration_rad_s2", "max_jerk_rad_s3"):
        np.testing.assert_allclose(getattr(again, name), getattr(model, name), rtol=1e-9)
    np.testing.assert_allclose(again.last_from_pivot, model.last_from_pivot, atol=1e-12)
    plain = {"joints": (), "home_yaw_rad": 0.0, "home_rad": ()}
    assert replace(again, **plain) == replace(model, **plain)
    for ours, theirs in zip(again.joints, model.joints, strict=True):
        assert ours.link_capsule == theirs.link_capsule
        assert ours.origin_rpy_rad == theirs.origin_rpy_rad

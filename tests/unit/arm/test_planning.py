"""Planning: what a pose can do, when a session is refused and what is offered, and that a search finds good poses."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.errors import UserError
from station import __main__ as station
from station.arm.collision import CollisionScene
from station.arm.planning import Pose, assess, require_reach, require_session, search
from station.arm.search import evaluate, home_poses
from station.arm.tilt_path import TiltStage, tilt_path, tilt_stage
from station.rig.arm_model import ArmModel
from station.rig.arm_settings import ArmSettings, ObstacleSettings

FOUR = [number * math.pi / 2 for number in range(4)]


def pose_of(stage: TiltStage, azimuths_rad: list[float]) -> Pose:
    scene = CollisionScene(stage.model, world_from_base=stage.world_from_base, obstacles=ObstacleSettings())
    return assess(stage, scene=scene, azimuths_rad=azimuths_rad)


@pytest.fixture(scope="module")
def narrow(model: ArmModel) -> TiltStage:
    """An arm whose second joint stops early, so that one direction falls short."""
    joints = (*model.joints[:1], replace(model.joints[1], lower_rad=2.7), *model.joints[2:])
    limited = replace(model, joints=joints)
    return tilt_stage(limited, base_xyz_m=(0, 0, 0), base_yaw_rad=0, home_rad=model.home_rad)


def test_the_home_pose_reaches_all_four_directions_with_margins(stage: TiltStage) -> None:
    pose = pose_of(stage, FOUR)
    assert math.degrees(pose.worst_rad) == pytest.approx(67.5)
    for reach in pose.reaches:
        assert reach.clearance_m >= ObstacleSettings().clearance_m
        assert math.degrees(reach.joint_margin_rad) > 5
        assert 0.05 < reach.torque_share < 0.5
        assert math.degrees(reach.rate_rad_s) > 5
    require_reach(pose, angle_rad=math.radians(67.5), directions=range(4))


def test_the_fastest_rate_is_what_the_joints_speeds_allow(stage: TiltStage) -> None:
    (reach,) = pose_of(stage, [math.pi / 2]).reaches
    path = tilt_path(stage, azimuth_rad=math.pi / 2)
    speeds = np.abs(path.slopes) * reach.rate_rad_s / stage.model.max_velocity_rad_s
    assert speeds.max() == pytest.approx(1.0)


def test_an_unreachable_step_is_named_with_the_best_alternative(narrow: TiltStage) -> None:
    pose = pose_of(narrow, FOUR)
    with pytest.raises(UserError) as refused:
        require_reach(pose, angle_rad=math.radians(67.5), directions=range(4))
    text = str(refused.value)
    assert "67.5 degrees in direction 3, azimuth 270.0" in text
    assert "joint_2 is at its lower limit" in text
    assert "Tilt in direction 0 alone (plan: [direction] some = [0]) and turn the sample" in text
    require_reach(pose, angle_rad=pose.worst_rad, directions=range(4))


def test_a_session_is_refused_from_the_rig_s_table_alone() -> None:
    require_session(ArmSettings(), angle_rad=math.radians(67.5), directions=range(4))
    curved = ArmSettings(model="jaco2_curved")
    require_session(curved, angle_rad=math.radians(67.5), directions=(0, 1))
    with pytest.raises(
        UserError, match=r"in direction 2, azimuth 180\.0, but the arm reaches 60\..*Tilt in direction 0"
    ):
        require_session(curved, angle_rad=math.radians(67.5), directions=range(4))


def test_free_azimuths_are_named_by_their_angle(narrow: TiltStage) -> None:
    with pytest.raises(UserError, match=r"in azimuth 270\.0.*Tilt in azimuth 0\.0 alone"):
        require_reach(pose_of(narrow, FOUR), angle_rad=math.radians(67.5))


def test_when_no_direction_reaches_it_that_is_said(narrow: TiltStage) -> None:
    with pytest.raises(UserError, match="No direction reaches it"):
        require_reach(pose_of(narrow, FOUR), angle_rad=math.radians(75), directions=range(4))


def test_a_home_pose_that_touches_something_reaches_nothing(stage: TiltStage) -> None:
    scene = CollisionScene(stage.model, world_from_base=stage.world_from_base, obstacles=ObstacleSettings(table_m=0.5))
    (reach,) = assess(stage, scene=scene, azimuths_rad=[0.0]).reaches
    assert reach.angle_rad == 0
    assert "the table" in reach.limit


def test_the_search_s_fast_reach_agrees_with_the_paths(model: ArmModel) -> None:
    pytest.importorskip("ssik", reason="ssik has no package for this system")
    poses = home_poses(model, distances_m=np.array([0.34]), heights_m=np.array([0.78]), turns_rad=[0.0])
    found = evaluate(model, poses, azimuths_rad=np.array(FOUR[:2]), max_angle_rad=math.radians(67.5))
    for index in range(len(found.joints_rad)):
        stage = tilt_stage(model, base_xyz_m=(0, 0, 0), base_yaw_rad=0, home_rad=found.joints_rad[index])
        for column in range(2):
            exact = tilt_path(stage, azimuth_rad=FOUR[column]).reach_rad
            assert found.reach_rad[index, column] == pytest.approx(exact, abs=math.radians(6.0))


def test_a_search_finds_a_pose_as_good_as_the_one_in_the_model(
    model: ArmModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("ssik", reason="ssik has no package for this system")
    monkeypatch.setattr("station.arm.planning._DISTANCES", np.array([0.32, 0.36]))
    monkeypatch.setattr("station.arm.planning._HEIGHTS", np.array([0.76, 0.8]))
    poses = search(model, obstacles=ObstacleSettings(), azimuths_rad=np.array(FOUR), keep=6)
    assert math.degrees(poses[0].worst_rad) == pytest.approx(67.5)
    assert [pose.worst_rad for pose in poses] == sorted((pose.worst_rad for pose in poses), reverse=True)


def test_the_command_prints_the_reach_and_draws_the_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture = tmp_path / "plan.png"
    assert station.main(["arm", "plan", "--every-deg", "90", "--picture", str(picture)]) == 0
    shown = capsys.readouterr().out
    assert "The four directions reach 0: 67.5, 1: 67.5, 2: 67.5, 3: 67.5 degrees." in shown
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_the_command_says_when_a_direction_falls_short(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture = str(tmp_path / "plan.png")
    assert station.main(["arm", "plan", "--model", "jaco2_curved", "--every-deg", "90", "--picture", picture]) == 1
    assert "use direction 0 alone and turn the sample" in capsys.readouterr().out


def test_an_unknown_model_is_a_user_s_mistake(capsys: pytest.CaptureFixture[str]) -> None:
    assert station.main(["arm", "plan", "--model", "no_such_arm"]) == 2
    assert "No arm model 'no_such_arm'" in capsys.readouterr().err

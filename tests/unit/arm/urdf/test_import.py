"""`station arm import` gives back what was planted in a URDF, and says what it had to estimate."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from station.__main__ import main as station
from station.arm.kinematics import pivot_pose
from station.rig.arm_model import ArmModel, load_arm_model
from tests.unit.arm.urdf.written_urdf import STAGE, urdf_of, written


@pytest.fixture(scope="module")
def planted() -> ArmModel:
    return load_arm_model("jaco2_spherical")


@pytest.fixture(scope="module")
def imported(planted: ArmModel, tmp_path_factory: pytest.TempPathFactory) -> ArmModel:
    folder = tmp_path_factory.mktemp("import")
    home = ",".join(map(repr, np.degrees(planted.home_rad).tolist()))
    words = ["--home-deg", home, "--name", "mine", "--out", str(folder / "mine.toml")]
    assert station(["arm", "import", str(written(folder, urdf_of(planted))), *words]) == 0
    return load_arm_model(folder / "mine.toml")


def test_joints_and_limits_come_back(planted: ArmModel, imported: ArmModel) -> None:
    assert imported.name == "mine"
    assert imported.joint_names == planted.joint_names
    for name in ("lower_rad", "upper_rad", "max_velocity_rad_s", "max_acceleration_rad_s2", "max_jerk_rad_s3"):
        np.testing.assert_allclose(getattr(imported, name), getattr(planted, name), rtol=1e-9)
    for ours, theirs in zip(imported.joints, planted.joints, strict=True):
        assert (ours.max_effort_nm, ours.link_mass_kg) == (theirs.max_effort_nm, theirs.link_mass_kg)


def test_the_plate_is_where_it_was(planted: ArmModel, imported: ArmModel) -> None:
    for q in np.random.default_rng(5).uniform(-3, 3, (20, 6)):
        np.testing.assert_allclose(pivot_pose(imported, q), pivot_pose(planted, q), atol=1e-9)


def test_capsules_come_back_to_a_few_millimetres(planted: ArmModel, imported: ArmModel) -> None:
    ours = [imported.base_capsule, *(joint.link_capsule for joint in imported.joints)]
    theirs = [planted.base_capsule, *(joint.link_capsule for joint in planted.joints)]
    for found, wanted in zip(ours, theirs, strict=True):
        assert found.radius_m == pytest.approx(wanted.radius_m, abs=1e-3)
        ends = [sorted([capsule.from_m, capsule.to_m]) for capsule in (found, wanted)]
        np.testing.assert_allclose(ends[0], ends[1], atol=4e-3)


def test_a_search_finds_a_home_pose_where_none_is_given(
    planted: ArmModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("ssik", reason="ssik has no package for this system")
    monkeypatch.setattr("station.arm.planning._DISTANCES", np.array([0.32, 0.36]))
    monkeypatch.setattr("station.arm.planning._HEIGHTS", np.array([0.76, 0.8]))
    out = tmp_path / "mine.toml"
    assert station(["arm", "import", str(written(tmp_path, urdf_of(planted))), "--out", str(out)]) == 0
    model = load_arm_model(out)
    assert math.isclose(pivot_pose(model, np.array(model.home_rad))[2, 2], 1.0, abs_tol=1e-9)


def test_what_is_not_said_is_estimated_and_that_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = STAGE.replace(' velocity="0.5" effort="3"', "")
    out = tmp_path / "stage.toml"
    assert station(["arm", "import", str(written(tmp_path, text)), "--out", str(out)]) == 0
    shown, toml = capsys.readouterr().out, out.read_text()
    for estimate in ("capsule: no geometry", "mass: none", "max_velocity: none", "max_effort: none"):
        assert f"Estimated: {estimate}" in shown
        assert f"# {estimate}" in toml
    joint = load_arm_model(out).joints[0]
    assert joint.link_capsule.to_m == (0.0, 0.0, 0.01)
    assert math.degrees(joint.max_velocity_rad_s) == pytest.approx(30)


def test_a_stranger_s_words_stay_comments(tmp_path: Path) -> None:
    text = STAGE.replace('name="stage"', 'name="x&#10;home_rad = 1 &quot;"').replace('name="plate"', 'name="p = 1"')
    out = tmp_path / "stage.toml"
    assert (
        station(["arm", "import", str(written(tmp_path, text.replace('"plate"', '"p = 1"'))), "--out", str(out)]) == 0
    )
    assert load_arm_model(out).name == 'x\nhome_rad = 1 "'


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["--out", "robot.urdf"], "is there; give another --out"),
        (["--package", "mine"], "Expected --package NAME=FOLDER"),
        (["--home-deg", "1,x"], "Expected angles in degrees"),
        (["--home-deg", "1,2"], "Expected 1 angles of the home pose, got 2"),
        (["--tip", "hand"], "Expected a link of stage"),
    ],
)
def test_a_mistake_is_said(
    words: list[str], named: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert station(["arm", "import", str(written(tmp_path, STAGE)), *words]) == 2
    assert named in capsys.readouterr().err
    assert not Path("stage.toml").exists()


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ('lower="-1.0" upper="1.2"', "", "got 0 to 0 rad"),
        ('velocity="0.5"', 'velocity="-1"', "positive velocity and effort of the joint 'tilts'"),
        ('xyz="0 0 0.01"', 'rpy="0.5 0 0"', "give a pose that holds the plate level: --home-deg"),
    ],
)
def test_a_robot_that_cannot_tilt_a_plate_is_refused(
    old: str, new: str, named: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert old in STAGE
    words = ["--out", str(tmp_path / "stage.toml")]
    assert station(["arm", "import", str(written(tmp_path, STAGE.replace(old, new))), *words]) == 2
    assert named in capsys.readouterr().err

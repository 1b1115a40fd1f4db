"""The arm descriptions against published poses, and their errors."""

from pathlib import Path

import numpy as np
import pytest

from shared.errors import UserError
from station.rig.arm_model import MODELS, forward_kinematics, link_transforms, load_arm_model

CHECK_RAD = (4.805, 2.925, 1.002, 4.203, 1.446, 1.323)


def test_the_curved_wrist_reaches_its_published_check_pose() -> None:
    pose = forward_kinematics(load_arm_model("jaco2_curved"), CHECK_RAD)
    np.testing.assert_allclose(pose[:3, 3], (0.2127, -0.2566, 0.507), atol=6e-4)


@pytest.mark.parametrize("path", sorted(MODELS.glob("*.toml")), ids=lambda path: path.stem)
def test_every_model_gives_proper_rotations(path: Path) -> None:
    rng = np.random.default_rng(1)
    model = load_arm_model(path)
    for q in rng.uniform(-3, 3, (20, len(model.joints))):
        rotation = forward_kinematics(model, q)[:3, :3]
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(rotation) == pytest.approx(1)


def test_the_axes_of_a_spherical_wrist_meet_in_one_point() -> None:
    rng = np.random.default_rng(2)
    model = load_arm_model("jaco2_spherical")
    q = rng.uniform(0, 6, 6)
    moved = q.copy()
    moved[3:] += rng.uniform(-1, 1, 3)
    np.testing.assert_allclose(link_transforms(model, q)[4, :3, 3], link_transforms(model, moved)[4, :3, 3], atol=1e-12)


def test_a_world_above_the_base_moves_the_whole_arm() -> None:
    model = load_arm_model("jaco2_spherical")
    lifted = np.eye(4)
    lifted[2, 3] = 0.7
    difference = forward_kinematics(model, model.home_rad, world_from_base=lifted) - forward_kinematics(
        model, model.home_rad
    )
    np.testing.assert_allclose(difference[:3, 3], (0, 0, 0.7), atol=1e-12)


def test_a_joint_turns_about_its_own_axis() -> None:
    model = load_arm_model("jaco2_spherical")
    before, after = (link_transforms(model, q)[0] for q in (np.zeros(6), np.array([0.3, 0, 0, 0, 0, 0])))
    turned = before[:3, :3].T @ after[:3, :3]
    np.testing.assert_allclose(
        turned, [[np.cos(0.3), -np.sin(0.3), 0], [np.sin(0.3), np.cos(0.3), 0], [0, 0, 1]], atol=1e-12
    )


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("max_effort_nm = 40.0", "", "max_effort_nm"),
        ("max_effort_nm = 40.0", "max_effort_nm = -1", "max_effort_nm"),
        ("axis = [0.0, 0.0, 1.0]", "axis = [0.0, 1.0]", "axis"),
        ("home_rad = [", "home_rad = [1.0, ", "home_rad"),
    ],
)
def test_a_wrong_model_file_is_named_with_what_is_wrong(tmp_path: Path, old: str, new: str, named: str) -> None:
    path = tmp_path / "arm.toml"
    path.write_text((MODELS / "jaco2_spherical.toml").read_text().replace(old, new, 1))
    with pytest.raises(UserError, match=named) as caught:
        load_arm_model(path)
    assert str(path) in str(caught.value)


def test_an_unknown_model_lists_the_known_ones() -> None:
    with pytest.raises(UserError, match="jaco2_spherical"):
        load_arm_model("no_such_arm")


@pytest.mark.parametrize("name", ["no_such_arm", "a" * 5000, "a\0b"])
def test_a_name_that_is_no_model_is_refused_in_a_short_sentence(name: str) -> None:
    with pytest.raises(UserError, match="No arm model") as refused:
        load_arm_model(name)
    assert len(str(refused.value)) < 300

"""Inverse kinematics: every branch leads to the pose, and the Jacobian is the derivative of the pose."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest

from shared.errors import UserError
from station.arm.kinematics import all_branches, follow, pivot_jacobian, pivot_pose, pose_error, solver, within_limits
from station.rig.arm_model import MODELS, ArmModel, load_arm_model


@pytest.mark.parametrize("path", sorted(MODELS.glob("*.toml")), ids=lambda path: path.stem)
def test_the_jacobian_is_the_derivative_of_the_pose(path: Path) -> None:
    model, rng = load_arm_model(path), np.random.default_rng(3)
    joints = len(model.joints)
    q, step = rng.uniform(-2, 2, joints), rng.normal(0, 1e-6, joints)
    pose, jacobian = pivot_jacobian(model, q)
    np.testing.assert_allclose(pose_error(pose, pivot_pose(model, q + step)), jacobian @ step, atol=1e-10)


def test_all_branches_reach_the_pose_within_limits(model: ArmModel) -> None:
    pytest.importorskip("ssik", reason="ssik has no package for this system")
    pose = pivot_pose(model, np.array(model.home_rad))
    found = all_branches(model, pose)
    assert len(found) == 8  # a spherical wrist: shoulder, elbow and wrist each both ways
    np.testing.assert_allclose(pivot_pose(model, found), np.broadcast_to(pose, (8, 4, 4)), atol=1e-9)
    assert within_limits(model, found).all()
    away = np.abs(np.mod(found - model.home_rad + math.pi, 2 * math.pi) - math.pi).max(axis=1)
    assert away.min() < 1e-6


def test_following_stays_on_its_branch(model: ArmModel) -> None:
    rng = np.random.default_rng(4)
    true = np.array(model.home_rad) + rng.normal(0, 0.05, (50, 6))
    found, error = follow(model, np.broadcast_to(model.home_rad, (50, 6)), pivot_pose(model, true))
    assert error.max() < 1e-9
    np.testing.assert_allclose(found, true, atol=1e-6)


def test_a_pose_out_of_reach_leaves_an_error_and_no_leap(model: ArmModel) -> None:
    far = pivot_pose(model, np.array(model.home_rad))
    far[0, 3] += 3.0
    found, error = follow(model, np.array(model.home_rad), far)
    assert error > 0.1
    assert np.isfinite(found).all()
    assert np.abs(found - model.home_rad).max() <= 4 * 0.2 + 1e-9


def test_without_its_package_the_solver_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ssik", None)
    with pytest.raises(UserError, match=r"run: .*install \"repose-friction\[arm\]\""):
        solver(load_arm_model("jaco2_spherical"))

"""Every arm driver keeps its promises: all drivers found in station/arm/drivers.

Each driver needs somebody at the other end: `ENDS` names it. A driver without an entry fails here, so that a new file
in the folder cannot go untested.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager

import numpy as np
import pytest

from shared.errors import UserError
from station.arm.drivers import driver_names, load_driver, match_joints
from station.arm.tilt_path import TiltStage, tilt_path, tilt_stage
from station.arm.trajectory import JointTrajectory, TiltLimits, TiltState, plan_tilt
from station.rig.arm_model import load_arm_model
from tests.contracts.arm_ends import ENDS, NEEDS, End
from tests.system.ros1 import stop_roscore


@pytest.fixture(scope="module", autouse=True)
def roscore_ended() -> Iterator[None]:
    """The real ROS master, if any test needed one, goes with this module."""
    yield
    stop_roscore()


@pytest.fixture(scope="module")
def stage() -> TiltStage:
    model = load_arm_model("jaco2_spherical")
    return tilt_stage(model, base_xyz_m=(0, 0, 0), base_yaw_rad=0, home_rad=model.home_rad)


def tilting(stage: TiltStage, angle_rad: float, *, rate_rad_s: float = 0.1) -> JointTrajectory:
    """A tilt from level."""
    path = tilt_path(stage, azimuth_rad=0.0)
    limits = TiltLimits()
    return plan_tilt(
        stage.model, path, start=TiltState(), angle_rad=angle_rad, rate_rad_s=rate_rad_s, limits=limits
    ).trajectory


@pytest.fixture(scope="module")
def motion(stage: TiltStage) -> JointTrajectory:
    return tilting(stage, 0.05)


@pytest.fixture(scope="module")
def long_motion(stage: TiltStage) -> JointTrajectory:
    """Half a minute: on a busy machine a word to the arm may take seconds of it."""
    return tilting(stage, 0.3, rate_rad_s=0.01)


@pytest.fixture(params=driver_names())
def end(request: pytest.FixtureRequest, stage: TiltStage) -> Iterator[End]:
    """A connected driver with an arm at its other end, standing at the home pose."""
    name: str = request.param
    assert name in ENDS, f"the driver {name} has no other end in tests/contracts/arm_ends.py"
    if name in NEEDS:
        NEEDS[name](request.config)
    make: Callable[[TiltStage], AbstractContextManager[End]] = ENDS[name]
    with make(stage) as opened:
        yield opened


def test_readings_come_in_the_model_s_order_and_units(end: End, stage: TiltStage) -> None:
    end.until(lambda: end.driver.read() is not None)
    reading = end.driver.read()
    assert reading is not None
    assert reading.names == stage.model.joint_names
    np.testing.assert_allclose(reading.position_rad, stage.home_rad, atol=1e-6)
    assert reading.velocity_rad_s.shape == reading.effort_nm.shape == (6,)
    assert {part.dtype for part in (reading.position_rad, reading.velocity_rad_s, reading.effort_nm)} == {
        np.dtype(float)
    }
    assert end.driver.fault() == ""


def test_stamps_go_forward(end: End) -> None:
    end.until(lambda: end.driver.read() is not None)
    stamps: list[int] = []
    for _ in range(20):
        end.advance()
        reading = end.driver.read()
        assert reading is not None
        stamps.append(reading.stamp_ns)
    assert stamps == sorted(stamps)
    assert stamps[-1] > stamps[0]


def test_a_motion_ends_at_its_last_sample(end: End, motion: JointTrajectory) -> None:
    end.until(lambda: end.driver.read() is not None)
    end.driver.start(motion, now_ns=end.now_ns())
    end.until(lambda: np.abs(end.arm_rad() - motion.position_rad[-1]).max() < 1e-6)
    end.until(lambda: _read(end, motion) < 1e-6)


def test_halting_stops_short_of_the_goal_and_stays(end: End, long_motion: JointTrajectory) -> None:
    end.until(lambda: end.driver.read() is not None)
    began = end.now_ns()
    end.driver.start(long_motion, now_ns=began)
    end.until(lambda: end.now_ns() - began > long_motion.duration_ns // 50)
    end.driver.halt(now_ns=end.now_ns())
    end.until(lambda: _rests(end))  # a controller may take a moment, and longer on a busy machine
    halted = end.arm_rad()
    for _ in range(40):
        end.advance()
    np.testing.assert_allclose(end.arm_rad(), halted, atol=1e-9)
    assert np.abs(halted - long_motion.position_rad[-1]).max() > math.radians(0.5)


def _rests(end: End) -> bool:
    """True if the arm is where it was thirty steps before."""
    before = end.arm_rad()
    for _ in range(30):
        end.advance()
    return bool(np.allclose(end.arm_rad(), before, rtol=0.0, atol=1e-9))


def test_halting_at_rest_moves_nothing(end: End, stage: TiltStage) -> None:
    end.until(lambda: end.driver.read() is not None)
    end.driver.halt(now_ns=end.now_ns())
    for _ in range(10):
        end.advance()
    np.testing.assert_allclose(end.arm_rad(), stage.home_rad, atol=1e-6)


def test_a_second_motion_replaces_the_first(end: End, motion: JointTrajectory, stage: TiltStage) -> None:
    end.until(lambda: end.driver.read() is not None)
    began = end.now_ns()
    end.driver.start(motion, now_ns=began)
    end.until(lambda: end.now_ns() - began > motion.duration_ns // 3)
    here = end.arm_rad()
    still = JointTrajectory(
        times_ns=np.array([0, 50_000_000]),
        position_rad=np.repeat(here[None], 2, axis=0),
        velocity_rad_s=np.zeros((2, len(stage.model.joints))),
    )
    end.driver.start(still, now_ns=end.now_ns())
    for _ in range(40):
        end.advance()
    assert np.abs(end.arm_rad() - here).max() < math.radians(0.5)


def _read(end: End, motion: JointTrajectory) -> float:
    reading = end.driver.read()
    return math.inf if reading is None else float(np.abs(reading.position_rad - motion.position_rad[-1]).max())


def test_an_unknown_driver_lists_the_known_ones(end: End) -> None:
    with pytest.raises(UserError, match="simulated"):
        load_driver("no_such_arm", link=end.link)


def test_a_missing_joint_is_named(stage: TiltStage) -> None:
    with pytest.raises(UserError, match="j2s6s300_joint_6"):
        match_joints(stage.model, stage.model.joint_names[:5])
    assert match_joints(stage.model, ("finger", *stage.model.joint_names[::-1])) == [6, 5, 4, 3, 2, 1]

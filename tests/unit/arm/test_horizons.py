"""A motion in short horizons is the motion while they are renewed, and rest when they are not."""

from __future__ import annotations

import numpy as np
import pytest

from station.arm.drivers._horizons import HORIZON_NS, RENEWAL_NS, Horizons
from station.arm.tilt_path import TiltStage
from station.arm.trajectory import JointTrajectory
from tests.unit.arm.test_stopping import tilting

TICK_NS = 8_000_000
BEGAN_NS = 10**18


@pytest.fixture(scope="module")
def motion(stage: TiltStage) -> JointTrajectory:
    return tilting(stage, rate_deg_s=5.0)


class Robot:
    """It plays to its end what it was told last."""

    def __init__(self, stage: TiltStage, motion: JointTrajectory) -> None:
        self.horizons = Horizons(stage.model.max_acceleration_rad_s2)
        self.now_ns = self.heard_ns = BEGAN_NS
        self.told = self.horizons.begin(motion, now_ns=BEGAN_NS)

    def hear(self, told: JointTrajectory | None) -> None:
        if told is not None:
            self.told, self.heard_ns = told, self.now_ns

    def halt(self) -> None:
        rest = self.horizons.halted(self.now_ns)
        assert rest is not None
        self.hear(rest)

    def run(self, until_ns: int) -> None:
        while self.now_ns < BEGAN_NS + until_ns:
            self.now_ns += TICK_NS
            self.hear(self.horizons.renewed(self.now_ns))

    def where(self, *, later_ns: int = 0) -> np.ndarray:
        return self.told.at(self.now_ns + later_ns - self.heard_ns)[0]


def test_renewed_horizons_are_the_motion(stage: TiltStage, motion: JointTrajectory) -> None:
    robot = Robot(stage, motion)
    while robot.now_ns < BEGAN_NS + motion.duration_ns + HORIZON_NS:
        robot.run(robot.now_ns - BEGAN_NS + TICK_NS)
        np.testing.assert_allclose(robot.where(), motion.at(robot.now_ns - BEGAN_NS)[0], rtol=0, atol=1e-5)
        assert robot.horizons.late_s(robot.now_ns) == 0.0
    np.testing.assert_array_equal(robot.where(), motion.position_rad[-1])


def test_a_robot_that_hears_no_more_rests(stage: TiltStage, motion: JointTrajectory) -> None:
    robot = Robot(stage, motion)
    robot.run(2_000_000_000)
    last_ns = robot.heard_ns
    rest = robot.told.position_rad[-1]
    np.testing.assert_array_equal(robot.where(later_ns=10**11), rest)
    assert robot.told.duration_ns < HORIZON_NS + 100_000_000  # at 5 degrees/s braking takes less
    planned = motion.at(last_ns - BEGAN_NS + HORIZON_NS)[0]
    assert np.abs(rest - planned).max() < 0.01
    assert np.abs(rest - motion.position_rad[-1]).max() > 0.05


def test_an_agent_that_was_away_too_long_goes_on_with_nothing(stage: TiltStage, motion: JointTrajectory) -> None:
    robot = Robot(stage, motion)
    robot.run(1_000_000_000)
    robot.now_ns = robot.heard_ns + HORIZON_NS - 1
    assert robot.horizons.late_s(robot.now_ns) == 0.0
    robot.now_ns += 20_000_001
    assert robot.horizons.renewed(robot.now_ns) is None
    assert robot.horizons.late_s(robot.now_ns) == pytest.approx(0.52, abs=1e-6)
    before = robot.where()
    robot.halt()
    np.testing.assert_allclose(robot.where(), before, rtol=0, atol=1e-6)
    assert robot.horizons.late_s(robot.now_ns) == 0.0


@pytest.mark.parametrize("at_ns", [1_000_000, 900_000_000, 2_050_000_000])
def test_a_halt_brakes_from_where_the_arm_was_told_to_be(stage: TiltStage, motion: JointTrajectory, at_ns: int) -> None:
    robot = Robot(stage, motion)
    robot.run(at_ns)
    before, velocity = robot.told.at(robot.now_ns - robot.heard_ns)
    robot.halt()
    np.testing.assert_allclose(robot.where(), before, rtol=0, atol=1e-9)
    rest = motion.at(robot.now_ns - BEGAN_NS + robot.told.duration_ns // 2)[0]
    np.testing.assert_allclose(robot.where(later_ns=HORIZON_NS), rest, rtol=0, atol=1e-5)
    assert ((robot.told.position_rad - before) @ velocity >= -1e-12).all()
    assert robot.told.duration_ns < RENEWAL_NS
    assert robot.horizons.renewed(robot.now_ns + HORIZON_NS) is None


def test_a_halt_at_rest_says_nothing(stage: TiltStage, motion: JointTrajectory) -> None:
    assert Horizons(stage.model.max_acceleration_rad_s2).halted(BEGAN_NS) is None
    robot = Robot(stage, motion)
    robot.run(motion.duration_ns + HORIZON_NS)
    assert robot.horizons.halted(robot.now_ns) is None

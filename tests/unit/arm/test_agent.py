"""The arm agent in simulated time: commands, reports, state, and what it does when things go wrong."""

from __future__ import annotations

import math

import numpy as np
import pytest

from shared.foxglove import Log
from shared.messages import Heartbeat, JointState, MotionReport, PlatformState
from station.arm.kinematics import pivot_pose
from station.arm.tilt_path import TiltStage, tilt_path
from station.rig.arm_settings import ArmSettings
from station.rig.tilt import tilt_rotation
from tests.unit.arm.conftest import TICK_NS, FakeRig, last_platform, tilt_deg


def test_a_commanded_tilt_is_executed_and_reported_from_begin_to_end(rig: FakeRig) -> None:
    assert rig.command(10).accepted
    rig.advance(3)
    begin, end = rig.reports
    assert (begin.run, begin.step, begin.end_ns, begin.fault) == (1, 1, 0, "")
    assert end.begin_ns == begin.begin_ns < end.end_ns
    assert end.fault == ""
    assert tilt_deg(rig) == pytest.approx(10, abs=1e-4)


@pytest.mark.parametrize("direction", range(4))
def test_the_published_attitude_is_that_of_the_joints(rig: FakeRig, stage: TiltStage, direction: int) -> None:
    rig.command(20, direction=direction)
    rig.advance(4)
    state = last_platform(rig)
    joints = rig.of(JointState)[-1]
    assert isinstance(joints, JointState)
    pose = pivot_pose(stage.model, np.array(joints.position_rad))
    np.testing.assert_allclose((state.px, state.py, state.pz), pose[:3, 3], atol=1e-9)
    expected = tilt_rotation(math.radians(20), azimuth_rad=direction * math.pi / 2)
    np.testing.assert_allclose(pose[:3, :3], expected, atol=1e-5)


def test_the_published_rate_is_the_derivative_of_the_attitude(rig: FakeRig) -> None:
    rig.command(30, direction=1, rate_deg_s=5)
    rig.advance(3)
    state = last_platform(rig)  # in mid-motion at 5 degrees/s about the plate's y
    np.testing.assert_allclose(np.degrees((state.wx, state.wy, state.wz)), (0, 5, 0), atol=1e-3)


def test_state_goes_out_at_least_a_hundred_times_a_second(rig: FakeRig) -> None:
    before = len(rig.of(PlatformState))
    rig.advance(1)
    assert len(rig.of(PlatformState)) - before == round(1e9 / TICK_NS)


def test_a_slip_in_mid_step_may_send_the_plate_back_at_once(rig: FakeRig) -> None:
    rig.command(30)
    rig.advance(1)
    assert rig.command(0).accepted
    rig.advance(4)
    assert [bool(report.end_ns) for report in rig.reports] == [False, True, False, True]
    assert "next command" in rig.reports[1].fault
    assert tilt_deg(rig) == pytest.approx(0, abs=1e-4)


def test_another_direction_is_refused_until_the_plate_is_level(rig: FakeRig) -> None:
    rig.command(5)
    rig.advance(2)
    refused = rig.command(5, direction=1)
    assert not refused.accepted
    assert "level it before tilting at 90.0" in refused.reason
    rig.command(0, direction=1)  # level is level, whatever the azimuth says
    rig.advance(2)
    assert rig.command(5, direction=1).accepted


def test_a_free_azimuth_is_taken_from_the_command(rig: FakeRig) -> None:
    rig.command(15, direction=-1, azimuth_deg=37)
    rig.advance(3)
    state = last_platform(rig)
    assert math.degrees(math.atan2(state.qy, state.qx)) == pytest.approx(37, abs=1e-3)


@pytest.mark.parametrize(
    ("angle", "direction", "azimuth", "said"),
    [
        (70, 0, 0, "out of reach"),
        (-5, 0, 0, "out of reach"),
        (math.nan, 0, 0, "finite"),
        (5, 7, 0, "direction 0 to 3"),
        (5, 1, 45, "Direction 1 means the azimuth 90 degrees"),
        (5, -1, math.inf, "finite"),
        (5, 0, math.inf, "finite"),
        (5, 2, math.nan, "finite"),
    ],
)
def test_senseless_commands_are_refused_with_a_sentence(
    rig: FakeRig, angle: float, direction: int, azimuth: float, said: str
) -> None:
    reply = rig.command(angle, direction=direction, azimuth_deg=azimuth)
    assert not reply.accepted
    assert said in reply.reason
    rig.advance(0.5)
    assert rig.reports == []


def test_nothing_moves_without_the_station_s_heartbeat() -> None:
    rig = FakeRig(ArmSettings())
    rig.advance(0.5, heartbeat=False)
    assert "no heartbeat" in rig.command(5).reason
    rig.advance(0.5, armed=False)
    assert "not armed" in rig.command(5).reason


def test_a_rig_that_is_not_armed_is_read_only() -> None:
    rig = FakeRig(ArmSettings(armed=False))
    rig.advance(0.5)
    assert "read-only" in rig.command(5).reason
    assert rig.of(PlatformState)


def test_a_real_arm_is_read_only_unless_the_rig_says_otherwise() -> None:
    assert ArmSettings().may_arm
    assert not ArmSettings(driver="ros1").may_arm
    assert ArmSettings(driver="ros1", armed=True).may_arm
    assert not ArmSettings(armed=False).may_arm


def test_when_the_station_dies_the_arm_holds_and_then_levels_slowly(rig: FakeRig) -> None:
    rig.command(40)
    rig.advance(2)
    rig.advance(2, heartbeat=False)
    held = tilt_deg(rig)
    assert 20 < held < 40
    rig.advance(3, heartbeat=False)
    assert tilt_deg(rig) == pytest.approx(held, abs=1e-6)
    rig.advance(25, heartbeat=False)
    assert tilt_deg(rig) == pytest.approx(0, abs=1e-4)
    assert "heartbeat is lost" in rig.reports[1].fault
    rates = [math.degrees(abs(state.wx)) for state in rig.of(PlatformState)[-2500:] if isinstance(state, PlatformState)]
    assert max(rates) <= 3.0 + 1e-3


def test_a_station_that_comes_back_may_go_on(rig: FakeRig) -> None:
    rig.command(40)
    rig.advance(2)
    rig.advance(3, heartbeat=False)
    rig.advance(1)
    assert rig.command(0).accepted
    rig.advance(6)
    assert tilt_deg(rig) == pytest.approx(0, abs=1e-4)


def test_an_emergency_stop_halts_within_a_tick_and_stays(rig: FakeRig) -> None:
    rig.command(40)
    rig.advance(1.5)
    assert rig.stop("operator").accepted
    rig.advance(0.02)  # the tick, and the next reading, which shows it
    at_stop = tilt_deg(rig)
    rig.advance(8)
    assert tilt_deg(rig) == pytest.approx(at_stop, abs=1e-6)
    assert rig.reports[-1].fault == "emergency stop: operator"
    assert "stopped (operator)" in rig.command(0).reason
    rig.bus.publish("session/heartbeat", Heartbeat(rig.clock.now_ns(), armed=False))
    rig.advance(0.2)
    assert rig.command(0).accepted


def test_an_arm_that_is_pushed_away_is_stopped_and_named(rig: FakeRig) -> None:
    rig.command(40)
    rig.advance(1)
    rig.disturb = lambda joints: joints + np.array([0, 0, 0, 0.1, 0, 0])
    rig.advance(1)
    assert "joint_4 is 5.8 degrees from where it should be" in rig.reports[-1].fault


def test_an_arm_that_falls_silent_is_stopped(rig: FakeRig) -> None:
    rig.command(40)
    rig.advance(1)
    rig.silent = True
    rig.advance(1)
    assert rig.reports[-1].fault == "the arm no longer reports its joints"


def test_an_arm_that_never_arrives_is_said_so(rig: FakeRig) -> None:
    rig.disturb = lambda joints: joints + 0.01  # 0.57 degrees: follows well enough, but does not arrive
    rig.command(5)
    rig.advance(6)
    assert "did not come to rest" in rig.reports[-1].fault


def test_a_restart_in_mid_tilt_finds_out_where_the_arm_stands(stage: TiltStage) -> None:
    rig = FakeRig(ArmSettings())
    tilted = tilt_path(stage, azimuth_rad=math.pi / 2).at(np.array([0.5]))[0][0]
    turns = np.array([2 * math.pi, 0, 0, -2 * math.pi, 0, 2 * math.pi])  # endless joints may have turned
    rig.position = tuple((tilted + turns).tolist())
    rig.advance(0.3)
    assert "level it before" in rig.command(10, direction=0).reason
    assert rig.command(0, direction=1).accepted
    rig.advance(6)
    assert tilt_deg(rig) == pytest.approx(0, abs=1e-3)


def test_an_arm_that_stands_elsewhere_is_not_moved(stage: TiltStage) -> None:
    rig = FakeRig(ArmSettings())
    rig.position = tuple((stage.home_rad + np.array([0.4, 0, 0, 0, 0, 0])).tolist())
    rig.advance(0.3)
    assert "not in its home pose" in rig.command(5).reason


def test_foreign_joint_names_are_named(rig: FakeRig) -> None:
    rig.names = ("panda_joint1",) * 6
    rig.advance(0.1)
    rig.command(5)
    rig.advance(0.3)
    faults = [report.fault for report in rig.of(MotionReport) if isinstance(report, MotionReport) and report.fault]
    assert "panda_joint1" in faults[-1]
    assert "j2s6s300_joint_1" in faults[-1]


def test_closing_halts_the_motion(rig: FakeRig) -> None:
    rig.command(40)
    rig.advance(1)
    rig.agent.close()
    assert rig.reports[-1].fault == "the arm agent ends"


def test_a_joint_state_of_a_year_ahead_is_said_and_makes_none_after_it_old(rig: FakeRig) -> None:
    ahead_ns = rig.clock.now_ns() + 365 * 86400 * 10**9
    rig.bus.publish("twin/joints", JointState(ahead_ns, rig.names, rig.position, rig.velocity, ()))
    for _ in range(5):
        rig.agent.tick(rig.clock.now_ns())
    assert len([line for line in rig.of(Log) if "s ahead and not taken" in str(line)]) == 1
    rig.advance(0.1)
    assert rig.command(10).accepted
    rig.advance(3)
    assert tilt_deg(rig) == pytest.approx(10, abs=1e-4)

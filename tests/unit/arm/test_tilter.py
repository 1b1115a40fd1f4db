"""The planner's memory: a motion is planned once, and never taken for another."""

from __future__ import annotations

import math

import numpy as np
import pytest

from shared.messages import TiltCommand
from station.arm.tilter import Plan, Tilter
from station.rig.arm_settings import ArmSettings

RATE_RAD_S = math.radians(5.0)


@pytest.fixture
def tilter() -> Tilter:
    tilter = Tilter.from_settings(ArmSettings())
    tilter.locate(tilter.stage.home_rad)
    return tilter


def carried_out(tilter: Tilter, angle_rad: float, *, direction: int = 0, rate_rad_s: float = RATE_RAD_S) -> Plan:
    plan = tilter.plan(TiltCommand(direction=direction, angle_rad=angle_rad), elapsed_ns=0, rate_rad_s=rate_rad_s)
    tilter.begin(plan)
    tilter.arrive()
    return plan


def test_a_run_s_steps_are_planned_once(tilter: Tilter) -> None:
    runs = [[carried_out(tilter, angle).motion for angle in (0.02, 0.05, 0.0)] for _ in range(3)]
    assert all(one is again for run in runs[1:] for one, again in zip(runs[0], run, strict=True))


def test_the_oldest_motion_is_forgotten_first(tilter: Tilter, monkeypatch: pytest.MonkeyPatch) -> None:
    """A session asks for ever new angles: what it remembers has an end, and does not begin again from nothing."""
    monkeypatch.setattr("station.arm.remembered.MOST_MOTIONS", 4)
    angles = (0.02, 0.0, 0.03, 0.0, 0.04, 0.0)
    first = [carried_out(tilter, angle).motion for angle in angles]
    again = [carried_out(tilter, angle).motion for angle in (0.03, 0.0, 0.04, 0.0, 0.02)]
    assert all(one is known for one, known in zip(again, first[2:], strict=False))
    assert again[-1] is not first[0]


def test_another_direction_goal_rate_or_start_is_another_motion(tilter: Tilter) -> None:
    first = carried_out(tilter, 0.02).motion
    carried_out(tilter, 0.0)
    turned = carried_out(tilter, 0.02, direction=1).motion
    carried_out(tilter, 0.0)
    slow = carried_out(tilter, 0.02, rate_rad_s=0.5 * RATE_RAD_S).motion
    on = carried_out(tilter, 0.04).motion
    motions = [first, turned, slow, on]
    assert len({motion.trajectory.position_rad.tobytes() for motion in motions}) == len(motions)


def test_what_is_taken_over_in_mid_motion_begins_there(tilter: Tilter) -> None:
    plan = carried_out(tilter, 0.2)
    carried_out(tilter, 0.0)
    tilter.begin(plan)
    for elapsed_ns in (300_000_000, 600_000_000):
        state = plan.motion.state(elapsed_ns)
        back = tilter.plan(TiltCommand(direction=0), elapsed_ns=elapsed_ns, rate_rad_s=RATE_RAD_S)
        place, slope = plan.motion.path.at(np.array([state.angle_rad]))
        assert back.motion.trajectory.position_rad[0] == pytest.approx(place[0], abs=1e-12)
        assert back.motion.trajectory.velocity_rad_s[0] == pytest.approx(slope[0] * state.rate_rad_s, abs=1e-12)


def test_a_motion_ends_exactly_where_it_was_to(tilter: Tilter) -> None:
    motion = carried_out(tilter, 0.1234).motion
    assert motion.state(motion.trajectory.duration_ns).angle_rad == 0.1234
    assert float(motion.profile.at(motion.profile.duration_s)[0]) == pytest.approx(0.1234, abs=1e-12)


def test_an_arm_near_a_known_path_is_located_on_it(tilter: Tilter) -> None:
    """A plate that is almost level has hardly an azimuth, and one at an azimuth of its own is only levelled."""
    for angle_rad in (0.0, 0.002, 0.4):
        place = tilter.path(math.pi / 2).at(np.array([angle_rad]))[0][0]
        tilter.forget()
        tilter.locate(place + math.radians(0.03) * np.array([1, -1, 1, -1, 1, -1]))
        plan = tilter.plan(TiltCommand(direction=1, angle_rad=0.5), elapsed_ns=0, rate_rad_s=RATE_RAD_S)
        np.testing.assert_allclose(plan.motion.trajectory.position_rad[0], place, rtol=0, atol=math.radians(0.3))

"""The twin's world: the arm follows, the block rests, slides, is stopped by the foam, and gets a new friction."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from station.simulators.mujoco.engine import set_tangents, step_in_stages
from station.simulators.mujoco.specimen import Friction
from station.simulators.mujoco.world import TwinWorld
from tests.unit.simulators.rides import arm_world, hinge_world, jaco, ramp, ride, settle, steps

STEEL = Friction(mean_angle_rad=0.35, scatter=0.2)
SURE = Friction(mean_angle_rad=0.35)


def test_steps_in_stages_are_the_steps_of_mujoco() -> None:
    """Bit for bit, so that the stage loop differs from `mj_step` by the turned frames only."""
    ours, theirs = (hinge_world(SURE, savings=False) for _ in range(2))
    for world in (ours, theirs):
        settle(world)
        ride(world, ramp(0.5, top_rad=0.5), seconds=1.2)
    one, other = ours._loose, theirs._loose  # pyright: ignore[reportPrivateUsage] (the loop itself is tested)
    assert one is not None
    assert other is not None
    for _ in range(50):
        step_in_stages(one.model, one.data, lambda: None)
        mujoco.mj_step(other.model, other.data)  # pyright: ignore[reportAttributeAccessIssue] (untyped library)
    assert one.data.ncon >= 4
    assert np.array_equal(one.qpos, other.qpos)
    assert np.array_equal(one.qvel, other.qvel)


def test_turned_tangents_are_a_frame() -> None:
    frame = np.array([0.6, 0.0, 0.8, 0, 0, 0, 0, 0, 0])
    set_tangents(frame, np.array([1.0, 0.0, 0.0]))
    axes = frame.reshape(3, 3)
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert axes[1] == pytest.approx([0.8, 0.0, -0.6])


def session(world: TwinWorld, runs: int) -> list[tuple[float, float]]:
    """Tilt to a slip and back, again and again; the friction angle of each run and the tilt at which it slipped."""
    seen: list[tuple[float, float]] = []
    for _ in range(runs):
        settle(world, seconds=1.0)
        world.place_block(0.0, 0.0, 0.3)
        settle(world)
        planted = world.friction_now.angle_rad
        up = ride(world, ramp(math.radians(10), top_rad=1.1), seconds=8, stop_m=3e-3)
        seen.append((planted, up.crossing(threshold_m=0.2e-3)[1]))
        top = up.tilt_rad[-1]
        ride(world, lambda time, top=top: (max(top - 0.5 * time, 0.0), -0.5 if 0.5 * time < top else 0.0), seconds=3)
    return seen


def test_the_same_seed_gives_the_same_numbers() -> None:
    one, other = (ride(hinge_world(STEEL, seed=5), ramp(0.2, top_rad=0.6), seconds=5) for _ in range(2))
    assert one.place_m.tobytes() == other.place_m.tobytes()
    assert one.tilt_rad.tobytes() == other.tilt_rad.tobytes()


def test_friction_is_drawn_anew_after_each_slide_and_not_in_between() -> None:
    world = hinge_world(STEEL, seed=3)
    settle(world)
    first = world.friction_now
    ride(world, ramp(0.3, top_rad=0.1), seconds=1)
    ride(world, lambda time: (max(0.1 - 0.3 * time, 0.0), 0.0), seconds=1)
    assert world.friction_now == first
    up = ride(world, ramp(0.3, top_rad=1.0), seconds=5, stop_m=5e-3)
    assert world.friction_now == first
    top = up.tilt_rad[-1]
    ride(world, lambda time: (max(top - time, 0.0), 0.0), seconds=2)
    assert world.block_at_rest
    assert world.friction_now != first


def test_the_slip_angle_is_the_planted_one() -> None:
    for planted, slipped in session(hinge_world(STEEL, seed=11), runs=6):
        late = (6 * math.cos(planted) * 0.2e-3 * math.radians(10) ** 2 / 9.81) ** (1 / 3)
        assert slipped - late == pytest.approx(planted, abs=math.radians(0.1))


def test_the_foam_keeps_the_block_within_the_cutout() -> None:
    world = hinge_world(SURE)
    settle(world)
    seen = ride(world, ramp(0.5, top_rad=0.9), seconds=4)
    reach = np.linalg.norm(seen.place_m, axis=1).max() + 0.01 * math.sqrt(0.5)
    assert 0.040 < reach < 0.052
    assert world.lost == 0
    assert world.block_at_rest
    back = ride(world, lambda time: (max(0.9 - 0.5 * time, 0.0), 0.0), seconds=3)
    assert world.block_at_rest
    assert np.linalg.norm(back.place_m[-1] - seen.place_m[-1]) < 2e-3


def departure_from_the_foam(*, savings: bool) -> tuple[float, float]:
    """A block is driven into the foam, levelled and tilted away: how far it crept, and at which tilt it slid."""
    world = hinge_world(SURE, savings=savings)
    settle(world)
    ride(world, ramp(0.5, top_rad=0.9), seconds=4)
    ride(world, lambda time: (max(0.9 - 0.5 * time, 0.0), 0.0), seconds=3)
    up = ramp(math.radians(5), top_rad=0.6)
    away = ride(world, lambda time: (-up(time)[0], -up(time)[1]), seconds=7, stop_m=3e-3)
    before = away.tilt_rad < 0.34
    crept_m = np.linalg.norm(away.place_m[before][-1] - away.place_m[0])
    return float(crept_m), math.degrees(away.crossing(threshold_m=1e-3)[1])


def test_the_savings_do_not_move_a_block_that_the_foam_presses_on() -> None:
    (crept_m, slid_deg), (crept_exactly_m, slid_exactly_deg) = (
        departure_from_the_foam(savings=savings) for savings in (True, False)
    )
    assert crept_exactly_m > 5e-5  # the foam pushes it along as the plate tilts
    assert crept_m == pytest.approx(crept_exactly_m, rel=0.1)
    assert slid_deg == pytest.approx(slid_exactly_deg, abs=0.1)


def test_the_arm_follows_with_a_small_lag_and_does_not_shake() -> None:
    tilter = jaco()
    world = arm_world(tilter, SURE)
    settle(world)
    profile = steps(math.radians(1.35), rate_rad_s=math.radians(5), hold_s=0.3)
    seen = ride(world, profile, seconds=6, tilter=tilter, azimuth_rad=0.4)
    wanted = np.array([profile(time)[0] for time in seen.time_s - 0.01])
    assert np.abs(seen.tilt_rad - wanted).max() < math.radians(0.15)
    resting = np.array([profile(time)[1] == 0 and profile(time - 0.2)[1] == 0 for time in seen.time_s - 0.01])
    assert resting.sum() > 20
    assert np.abs(seen.tilt_rad - wanted)[resting].max() < math.radians(0.01)


def test_the_pivot_stays_put_while_the_arm_tilts() -> None:
    """The block is not shaken: the centre of rotation moves by less than 0.3 mm through a whole tilt."""
    tilter = jaco()
    world = arm_world(tilter, SURE)
    settle(world)
    home = world.plate_pose().pivot
    path = tilter.path(0.0)
    for number in range(600):
        angle, rate = ramp(math.radians(5), top_rad=0.5)(number * 0.01)
        joints, slopes = path.at(np.array([angle]))
        world.set_target(joints[0].tolist(), (slopes[0] * rate).tolist())
        world.advance(world.time_ns + 10_000_000)
        assert np.linalg.norm(world.plate_pose().pivot - home) < 3e-4


def test_reading_between_steps_is_smooth() -> None:
    """Frames fall between time steps; a block that slides at 0.3 m/s would otherwise jump by half a millimetre."""
    world = hinge_world(Friction(mean_angle_rad=0.1))
    settle(world)
    seen = ride(world, ramp(1.0, top_rad=0.4), seconds=1, tick_ns=700_000, stop_m=0.02)
    sliding = seen.place_m[np.linalg.norm(seen.place_m, axis=1) > 0.003]
    second = np.diff(sliding[:, 1], 2)
    assert len(second) > 50
    assert np.abs(second).max() < 2e-5


def test_time_that_is_skipped_changes_nothing() -> None:
    world = hinge_world(SURE)
    settle(world, seconds=2)
    before = world.block_pose(), world.joints()
    world.advance(world.time_ns + 3_600_000_000_000)
    assert (world.block_pose(), world.joints()) == before
    seen = ride(world, ramp(math.radians(5), top_rad=0.6), seconds=6, stop_m=1e-3)
    assert not math.isnan(seen.crossing()[0])


def test_an_absent_block_and_its_return() -> None:
    world = hinge_world(SURE)
    settle(world)
    world.remove_block()
    ride(world, ramp(0.5, top_rad=0.8), seconds=2)
    assert world.block_pose().position == (0.0, 0.0, -1.0)
    assert not world.block_present
    world.place_block(0.01, 0.02, 0.5)
    ride(world, lambda time: (max(0.8 - 0.5 * time, 0.0), 0.0), seconds=3)
    x, y, z = world.block_pose().position
    assert (x, y) == pytest.approx((0.01, 0.02), abs=1e-4)
    assert z == pytest.approx(0.005, abs=1e-4)
    assert world.block_at_rest


def test_a_block_that_fell_over_is_put_back() -> None:
    world = hinge_world(Friction(mean_angle_rad=1.2))
    settle(world)
    # A cube tips over at 45 degrees; where it is much steeper it tumbles beyond the foam.
    fallen = ride(world, ramp(0.5, top_rad=0.8), seconds=2.2)
    assert world.block_pose().lean_rad > 0.3
    assert fallen.tilt_rad[-1] > 0.75
    before = world.lost
    ride(world, lambda time: (max(0.8 - 0.5 * time, 0.0), 0.0), seconds=4)
    settle(world)
    assert world.lost == before + 1
    assert world.block_pose().position == pytest.approx((0.0, 0.0, 0.005), abs=1e-4)
    assert world.block_pose().lean_rad < 0.01


def test_mistakes_are_refused() -> None:
    world = hinge_world(SURE)
    with pytest.raises(ValueError, match="expected 1 joints"):
        world.set_target([0.0, 0.0], [0.0])
    with pytest.raises(ValueError, match="within"):
        world.place_block(0.04, 0.0, 0.0)

"""The twin holds a block until the right angle, and MuJoCo's defaults would not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from station.simulators import slider
from station.simulators.mujoco.contact import EXACT, MUJOCO_DEFAULT, Contact
from station.simulators.mujoco.specimen import Block, Friction
from tests.unit.simulators.rides import Profile, arm_world, exact, hinge_world, jaco, ramp, ride, settle, steps

MU = 0.5
FRICTION = Friction(mean_angle_rad=math.atan(MU))
CIRCLE = slider.LimitCurve(mu_along=MU, mu_across=MU)
FINE_NS = 4_000_000
TILTER = jaco()


def onset_error_deg(
    profile: Profile,
    *,
    azimuth_rad: float = 0.0,
    yaw_rad: float = 0.0,
    contact: Contact = EXACT,
    savings: bool = True,
    block: Block | None = None,
) -> float:
    """Tilt read at 0.5 mm in the twin, through the whole arm, minus the exact slider's on the same plate motion."""
    world = arm_world(TILTER, FRICTION, contact=contact, savings=savings, block=block)
    world.place_block(0.0, 0.0, yaw_rad)
    settle(world)
    seen = ride(world, profile, seconds=30, tilter=TILTER, azimuth_rad=azimuth_rad, tick_ns=FINE_NS, stop_m=1e-3)
    return math.degrees(seen.crossing()[1] - exact(seen, CIRCLE, azimuth_rad=azimuth_rad)[1])


@pytest.mark.parametrize(
    ("rate_deg_s", "azimuth_rad", "yaw_rad"), [(2, 0.0, 0.0), (5, math.pi / 2, 0.3), (5, 0.6, 0.0), (10, math.pi, 0.0)]
)
def test_onset_on_a_ramp_is_right_within_three_hundredths_of_a_degree(
    rate_deg_s: float, azimuth_rad: float, yaw_rad: float
) -> None:
    profile = ramp(math.radians(rate_deg_s), top_rad=0.6)
    assert abs(onset_error_deg(profile, azimuth_rad=azimuth_rad, yaw_rad=yaw_rad)) < 0.03


@pytest.mark.parametrize("azimuth_rad", [0.0, 3 * math.pi / 2])
def test_onset_in_the_steps_of_a_session_is_right_within_three_hundredths_of_a_degree(azimuth_rad: float) -> None:
    profile = steps(math.radians(1.35), rate_rad_s=math.radians(5), hold_s=0.1, start_rad=0.38)
    assert abs(onset_error_deg(profile, azimuth_rad=azimuth_rad)) < 0.03


def test_a_half_gram_block_of_wood_holds_as_well() -> None:
    """The solver's stopping rule is relative to the arm's inertia; with MuJoCo's own, a light block slides early."""
    profile = ramp(math.radians(5), top_rad=0.6)
    assert abs(onset_error_deg(profile, block=Block(mass_kg=0.0005))) < 0.03


def test_mujocos_default_contact_would_fail() -> None:
    """With MuJoCo's defaults the block has moved half a millimetre degrees before it should start at all."""
    world = arm_world(TILTER, FRICTION, contact=MUJOCO_DEFAULT, savings=False)
    world.advance(500_000_000)
    seen = ride(world, ramp(math.radians(5), top_rad=0.6), seconds=8, tilter=TILTER, tick_ns=FINE_NS, stop_m=1e-3)
    assert math.degrees(seen.crossing()[1] - math.atan(MU)) < -5


@pytest.mark.parametrize(
    "profile",
    [
        ramp(math.radians(2), top_rad=0.6),
        ramp(math.radians(5), top_rad=0.6),
        steps(math.radians(1.35), rate_rad_s=math.radians(5), hold_s=0.1, start_rad=0.38),
    ],
    ids=["2 deg/s", "5 deg/s", "steps"],
)
def test_the_savings_do_not_move_the_onset(profile: Profile) -> None:
    with_savings = onset_error_deg(profile)
    without = onset_error_deg(profile, savings=False)
    assert abs(with_savings - without) < 0.01


def test_a_hold_just_below_the_limit_lasts() -> None:
    """The block must not creep at 97 % of the friction: MuJoCo's own settings lose millimetres here."""
    world = hinge_world(FRICTION, savings=False)
    settle(world)
    angle = math.atan(0.97 * MU)
    seen = ride(world, ramp(math.radians(10), top_rad=angle), seconds=13)
    held = seen.time_s > 4
    moved = np.linalg.norm(seen.place_m[held] - seen.place_m[held][0], axis=1).max()
    assert moved < 2e-5


@pytest.mark.parametrize(
    ("azimuth_rad", "fixed_in", "yaw_rad"), [(0.0, "plate", 0.4), (0.0, "object", 0.4), (1.0, "object", -0.5)]
)
def test_an_elliptic_limit_curve_is_met_in_the_frame_it_is_fixed_in(
    azimuth_rad: float, fixed_in: str, yaw_rad: float
) -> None:
    friction = Friction(mean_angle_rad=0.45, ratio=0.7, axis_rad=0.2, fixed_in=fixed_in)  # type: ignore[arg-type]
    world = hinge_world(friction, azimuth_rad=azimuth_rad)
    world.place_block(0.0, 0.0, yaw_rad)
    settle(world)
    profile = ramp(math.radians(5), top_rad=0.7)
    seen = ride(world, profile, seconds=12, azimuth_rad=azimuth_rad, tick_ns=FINE_NS, stop_m=1e-3)
    draw = world.friction_now
    axis = 0.2 + (yaw_rad if fixed_in == "object" else 0.0)
    curve = slider.LimitCurve(mu_along=draw.mu_along, mu_across=draw.mu_across, axis_rad=axis)
    assert abs(math.degrees(seen.crossing()[1] - exact(seen, curve, azimuth_rad=azimuth_rad)[1])) < 0.1

"""Rides of the twin: tilt profiles driven through the arm, and what plate and block did meanwhile."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from station.arm.tilter import Tilter
from station.rig.arm_model import ArmModel, Capsule, Joint
from station.rig.arm_settings import ArmSettings
from station.rig.tilt import tilt_of_rotation
from station.simulators import slider
from station.simulators.mujoco.specimen import Friction
from station.simulators.mujoco.world import TwinWorld

FLOATS = NDArray[np.float64]
Profile = Callable[[float], tuple[float, float]]
"""Angle (rad) and rate (rad/s) at a time (s)."""
TICK_NS = 10_000_000
THRESHOLD_M = 0.5e-3


@dataclass(frozen=True)
class Ride:
    """The values seen at each tick: time (s), tilt (rad), the block's place (n, 2) and yaw."""

    time_s: FLOATS
    tilt_rad: FLOATS
    place_m: FLOATS
    yaw_rad: FLOATS

    def crossing(self, *, threshold_m: float = THRESHOLD_M) -> tuple[float, float]:
        """Time and tilt at which the block had moved by the threshold; nan when it never did."""
        return crossing(self.time_s, self.tilt_rad, self.place_m, threshold_m=threshold_m)


def crossing(time_s: FLOATS, tilt_rad: FLOATS, place_m: FLOATS, *, threshold_m: float) -> tuple[float, float]:
    moved = np.linalg.norm(place_m - place_m[0], axis=1)
    late = np.flatnonzero(moved > threshold_m)
    if not len(late):
        return math.nan, math.nan
    i = int(late[0])
    # The displacement grows as the cube of the time, so its cube root is a straight line.
    before, after = np.cbrt(moved[i - 1]), np.cbrt(moved[i])
    share = (np.cbrt(threshold_m) - before) / (after - before)
    return (
        float(time_s[i - 1] + share * (time_s[i] - time_s[i - 1])),
        float(tilt_rad[i - 1] + share * (tilt_rad[i] - tilt_rad[i - 1])),
    )


def ramp(rate_rad_s: float, *, top_rad: float, rise_s: float = 0.3) -> Profile:
    """A constant rate from level to a top angle, with smooth ends."""
    begin, end = rise_s, top_rad / rate_rad_s

    def at(time: float) -> tuple[float, float]:
        if time <= 0:
            return 0.0, 0.0
        if time < begin:
            u = time / begin
            return rate_rad_s * begin * (u**3 - u**4 / 2), rate_rad_s * (3 * u**2 - 2 * u**3)
        if time < end + begin / 2:
            return rate_rad_s * (time - begin / 2), rate_rad_s
        return top_rad, 0.0

    return at


def steps(step_rad: float, *, rate_rad_s: float, hold_s: float, start_rad: float = 0.0) -> Profile:
    """The session's way: smooth steps (quintic) with holds between them, after one quicker tilt to `start_rad`."""
    move_s = 1.875 * step_rad / rate_rad_s
    first_s = max(1.875 * start_rad / math.radians(10), 1e-3)

    def at(time: float) -> tuple[float, float]:
        if time < first_s:
            share, slope = _quintic(max(time, 0.0) / first_s)
            return start_rad * share, start_rad * slope / first_s
        number, rest = divmod(time - first_s, move_s + hold_s)
        share, slope = _quintic(min(rest / move_s, 1.0))
        return start_rad + step_rad * (number + share), step_rad * slope / move_s

    return at


def _quintic(u: float) -> tuple[float, float]:
    return u**3 * (10 - 15 * u + 6 * u * u), 30 * u * u * (1 - u) ** 2


def jaco() -> Tilter:
    """The arm of the default rig, in its place."""
    return Tilter.from_settings(ArmSettings())


def hinge(*, azimuth_rad: float = 0.0) -> ArmModel:
    """A plate on a single horizontal hinge: an arm without an arm."""
    capsule = Capsule(from_m=(0, 0, -0.02), to_m=(0, 0, -0.05), radius_m=0.02)
    joint = Joint(
        name="tilt",
        origin_xyz_m=(0, 0, 0.5),
        origin_rpy_rad=(0, 0, 0),
        axis=(math.cos(azimuth_rad), math.sin(azimuth_rad), 0.0),
        lower_rad=None,
        upper_rad=None,
        max_velocity_rad_s=1.0,
        max_acceleration_rad_s2=3.0,
        max_jerk_rad_s3=30.0,
        max_effort_nm=40.0,
        link_mass_kg=0.5,
        link_capsule=capsule,
    )
    return ArmModel(
        name="hinge",
        source="a test",
        joints=(joint,),
        base_mass_kg=1.0,
        base_capsule=capsule,
        flange_xyz_m=(0, 0, -0.005),
        flange_rpy_rad=(0, 0, 0),
        plate_xyz_m=(0, 0, 0),
        plate_rpy_rad=(0, 0, 0),
        pivot_above_plate_m=0.005,
        home_rad=(0.0,),
    )


def hinge_world(friction: Friction, *, azimuth_rad: float = 0.0, seed: int = 1, **options: Any) -> TwinWorld:
    rng = np.random.default_rng(seed)
    return TwinWorld(hinge(azimuth_rad=azimuth_rad), friction=friction, rng=rng, joint_start_rad=[0.0], **options)


def arm_world(tilter: Tilter, friction: Friction, *, seed: int = 1, **options: Any) -> TwinWorld:
    stage = tilter.stage
    return TwinWorld(
        stage.model,
        friction=friction,
        rng=np.random.default_rng(seed),
        joint_start_rad=stage.home_rad.tolist(),
        world_from_base=stage.world_from_base,
        **options,
    )


def settle(world: TwinWorld, *, seconds: float = 0.5, tick_ns: int = TICK_NS) -> None:
    """Lets the block come to rest on the plate."""
    for _ in range(round(seconds * 1e9 / tick_ns)):
        world.advance(world.time_ns + tick_ns)
    assert world.block_at_rest


def ride(
    world: TwinWorld,
    profile: Profile,
    *,
    seconds: float,
    tilter: Tilter | None = None,
    azimuth_rad: float = 0.0,
    tick_ns: int = TICK_NS,
    stop_m: float = math.inf,
) -> Ride:
    """Drives the profile through the arm (or the hinge), until the block has moved by `stop_m`."""
    path = tilter.path(azimuth_rad) if tilter else None
    start_ns = world.time_ns
    rows: list[tuple[float, ...]] = []
    for number in range(round(seconds * 1e9 / tick_ns)):
        time = number * tick_ns * 1e-9
        angle, rate = profile(time)
        if path is None:
            world.set_target([angle], [rate])
        else:
            joints, slopes = path.at(np.array([angle]))
            world.set_target(joints[0].tolist(), (slopes[0] * rate).tolist())
        world.advance(start_ns + (number + 1) * tick_ns)
        tilt, _ = tilt_of_rotation(world.plate_pose().rotation)
        pose = world.block_pose()
        rows.append((time + tick_ns * 1e-9, tilt, *pose.position[:2], pose.yaw_rad))
        if math.dist(rows[0][2:4], rows[-1][2:4]) > stop_m:
            break
    table = np.array(rows)
    return Ride(table[:, 0], table[:, 1], table[:, 2:4], table[:, 4])


def exact(
    ride: Ride, curve: slider.LimitCurve, *, azimuth_rad: float, threshold_m: float = THRESHOLD_M
) -> tuple[float, float]:
    """Returns time and tilt of the crossing as the exact slider has it, on the tilt that the plate really had."""
    few = slice(None, None, 8)
    tilt = slider.Tilt(time_s=tuple(ride.time_s[few]), angle_rad=tuple(ride.tilt_rad[few]), azimuth_rad=azimuth_rad)
    slide = slider.simulate(tilt, curve, start_m=tuple(ride.place_m[0]), output_s=0.002)
    angle = np.interp(slide.time_s, ride.time_s, ride.tilt_rad)
    return crossing(slide.time_s, angle, slide.place_m, threshold_m=threshold_m)

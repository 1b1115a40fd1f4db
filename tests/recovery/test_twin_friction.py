"""Mean and scatter of the angle of repose that are planted in the twin come out again, through the whole arm."""

from __future__ import annotations

import math

import numpy as np

from station.rig.tilt import downhill_in_plate
from station.simulators.mujoco.specimen import Friction
from tests.unit.simulators.rides import arm_world, crossing, jaco, ramp, ride, settle

PLANTED = Friction(mean_angle_rad=0.35, scatter=0.20)
RUNS = 24
RATE_RAD_S = math.radians(10)
SEEN_M = 1e-3
FOAM_RAD = 0.01


def test_mean_and_scatter_of_the_slip_angle_are_recovered() -> None:
    tilter = jaco()
    world = arm_world(tilter, PLANTED, seed=20)
    settle(world)
    slipped, planted = [], []
    for run in range(RUNS):
        azimuth = away_from_the_border(world.block_pose().position)
        planted.append(world.friction_now.angle_rad)
        up = ride(world, ramp(RATE_RAD_S, top_rad=1.1), seconds=8, tilter=tilter, azimuth_rad=azimuth, stop_m=3e-3)
        # The foam in which a block stopped pushes it out by tenths of a millimetre as the plate tilts: that is spent.
        late = up.tilt_rad > planted[-1] - FOAM_RAD
        angle = crossing(up.time_s[late], up.tilt_rad[late], up.place_m[late], threshold_m=SEEN_M)[1]
        # A displacement is seen late by a known law (the cube root of the way).
        slipped.append(angle - (6 * math.cos(angle) * SEEN_M * RATE_RAD_S**2 / 9.81) ** (1 / 3))
        top = float(up.tilt_rad[-1])
        ride(world, lambda time, top=top: back(time, top), seconds=4, tilter=tilter, azimuth_rad=azimuth)
        assert world.block_at_rest, run
    error = np.abs(np.array(slipped) - np.array(planted))
    # The foam may hold a block that lies at the border; everywhere else the angle is right to a tenth of a degree.
    assert np.median(error) < math.radians(0.1)
    sd = PLANTED.mean_angle_rad * PLANTED.scatter
    assert abs(np.mean(slipped) - PLANTED.mean_angle_rad) < 3 * sd / math.sqrt(RUNS)
    assert abs(np.std(slipped, ddof=1) / sd - 1) < 3 / math.sqrt(2 * (RUNS - 1))


def away_from_the_border(place: tuple[float, float, float]) -> float:
    """The azimuth of the paper's four that slides the block across the plate's centre."""
    azimuths = [direction * math.pi / 2 for direction in range(4)]
    return min(azimuths, key=lambda azimuth: float(downhill_in_plate(azimuth)[:2] @ np.array(place[:2])))


def back(time: float, top_rad: float) -> tuple[float, float]:
    """Back to level at up to 20°/s, smoothly."""
    share = min(time * math.radians(20) / 1.875 / top_rad, 1.0)
    rate = 30 * share**2 * (1 - share) ** 2 * math.radians(20) / 1.875
    return top_rad * (1 - share**3 * (10 - 15 * share + 6 * share**2)), -rate

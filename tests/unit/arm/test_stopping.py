"""A stop in mid-motion stays on the motion's path and inside the gate's limits, wherever it begins."""

from __future__ import annotations

import math

import numpy as np
import pytest

from station.arm.limits import extremes, trajectory_fault
from station.arm.stopping import resting
from station.arm.tilt_path import TiltStage, tilt_path
from station.arm.trajectory import JointTrajectory, TiltLimits, TiltState, plan_tilt
from station.rig.arm_settings import GateSettings


def tilting(stage: TiltStage, *, rate_deg_s: float, angle_deg: float = 20.0) -> JointTrajectory:
    return plan_tilt(
        stage.model,
        tilt_path(stage, azimuth_rad=0.0),
        start=TiltState(),
        angle_rad=math.radians(angle_deg),
        rate_rad_s=math.radians(rate_deg_s),
        limits=TiltLimits(),
    ).trajectory


@pytest.mark.parametrize("rate_deg_s", [0.5, 5.0, 20.0])
@pytest.mark.parametrize("share", [1.0, 0.5])
def test_a_stop_passes_the_gate_from_any_moment(stage: TiltStage, rate_deg_s: float, share: float) -> None:
    motion = tilting(stage, rate_deg_s=rate_deg_s, angle_deg=min(20.0, 4 * rate_deg_s))
    limit = share * stage.model.max_acceleration_rad_s2
    for at_ns in range(0, motion.duration_ns - 1, motion.duration_ns // 40):
        stop = resting(motion, from_ns=at_ns, braking_ns=at_ns, max_acceleration_rad_s2=limit)
        rests = (at_ns + stop.duration_ns // 2, motion.duration_ns)  # braked evenly, or left to rest by itself
        assert min(np.abs(stop.position_rad[-1] - motion.at(rest_ns)[0]).max() for rest_ns in rests) <= 1e-9
        position, velocity = motion.at(at_ns)
        np.testing.assert_array_equal(stop.position_rad[0], position)
        np.testing.assert_array_equal(stop.velocity_rad_s[0], velocity)
        assert trajectory_fault(stop, stage=stage, settings=GateSettings(acceleration_share=share)) == ""
        assert ((stop.position_rad - position) @ velocity >= -1e-12).all()  # never back
        speed = np.abs(velocity / limit).max()
        own = np.abs(extremes(motion)[1] / limit).max()
        assert stop.duration_ns <= max(motion.duration_ns - at_ns, 0) + 1
        if own < 0.5:  # a motion with room left in its accelerations is stopped with at least half of them
            assert stop.duration_ns <= 2e9 * speed + 60_000_000


def test_a_motion_is_played_until_it_brakes(stage: TiltStage) -> None:
    motion = tilting(stage, rate_deg_s=5.0)
    limit = stage.model.max_acceleration_rad_s2
    begin, end = 1_003_000_000, 1_503_000_000
    told = resting(motion, from_ns=begin, braking_ns=end, max_acceleration_rad_s2=limit)
    for elapsed in range(0, end - begin, 1_000_000):
        np.testing.assert_allclose(told.at(elapsed)[0], motion.at(begin + elapsed)[0], rtol=0, atol=1e-6)
    assert not told.velocity_rad_s[-1].any()


def test_a_motion_that_ends_before_it_brakes_is_played_to_its_end(stage: TiltStage) -> None:
    motion = tilting(stage, rate_deg_s=5.0)
    limit = stage.model.max_acceleration_rad_s2
    begin = motion.duration_ns - 300_000_007
    told = resting(motion, from_ns=begin, braking_ns=10**12, max_acceleration_rad_s2=limit)
    assert told.duration_ns == 300_000_007
    np.testing.assert_array_equal(told.position_rad[-1], motion.position_rad[-1])


@pytest.mark.parametrize("rate_deg_s", [0.5, 5.0, 20.0])
def test_samples_are_close_enough_for_a_cubic(stage: TiltStage, rate_deg_s: float) -> None:
    motion = tilting(stage, rate_deg_s=rate_deg_s, angle_deg=min(20.0, 4 * rate_deg_s))
    limit = stage.model.max_acceleration_rad_s2
    told = resting(motion, from_ns=0, braking_ns=10**12, max_acceleration_rad_s2=limit)
    moments = range(0, motion.duration_ns, 1_700_001)
    off = max(np.abs(told.at(moment)[0] - motion.at(moment)[0]).max() for moment in moments)
    assert off < 3e-6

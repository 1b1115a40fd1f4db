"""A motion that ends early: it is slowed along its own path, every point of which the safety gate has seen.

Time runs ever slower along the plan until it stands. So no joint is faster than planned, and the plate's pivot rests.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from station.arm.limits import extremes
from station.arm.trajectory import JointTrajectory

Array = NDArray[np.float64]
STEP_NS = 20_000_000
"""The time between two samples: a cubic between them is off by less than 3e-6 rad in tilts of up to 20 degrees/s (a
test in test_stopping.py), and half a second of them is encoded for ROS in 0.3 ms, a tick being 8 ms."""


def resting(
    motion: JointTrajectory, *, from_ns: int, braking_ns: int, max_acceleration_rad_s2: Array
) -> JointTrajectory:
    """Returns the motion from one moment on, braked to rest from a second one on; its times begin at 0.

    It is braked as hard as the accelerations allow. Where the motion itself comes to rest earlier, it is left as it is.

    Args:
        motion: the plan.
        from_ns: the first sample's moment, ns after the begin of the plan.
        braking_ns: the moment at which it begins to brake, ns after the begin of the plan, not before `from_ns`.
        max_acceleration_rad_s2: (n,) the largest acceleration of each joint while it brakes, rad/s².
    """
    brake = _brake(motion, braking_ns, max_acceleration_rad_s2)
    if brake is None:
        return _played(motion, from_ns, motion.duration_ns)
    planned = _played(motion, from_ns, braking_ns)
    return JointTrajectory(
        times_ns=np.concatenate([planned.times_ns, planned.times_ns[-1] + brake.times_ns[1:]]),
        position_rad=np.concatenate([planned.position_rad, brake.position_rad[1:]]),
        velocity_rad_s=np.concatenate([planned.velocity_rad_s, brake.velocity_rad_s[1:]]),
    )


def _played(motion: JointTrajectory, from_ns: int, end_ns: int) -> JointTrajectory:
    steps = max(1, round((end_ns - from_ns) / STEP_NS))
    moments = [from_ns + max(end_ns - from_ns, 0) * step // steps for step in range(steps + 1)]
    return _sampled(motion, moments if end_ns > from_ns else moments[:1])


def _sampled(motion: JointTrajectory, moments_ns: list[int]) -> JointTrajectory:
    states = [motion.at(moment) for moment in moments_ns]
    times_ns = np.array(moments_ns, dtype=np.int64) - moments_ns[0]
    position, velocity = (np.array(part) for part in zip(*states, strict=True))
    return JointTrajectory(times_ns=times_ns, position_rad=position, velocity_rad_s=velocity)


def _brake(motion: JointTrajectory, at_ns: int, max_acceleration_rad_s2: Array) -> JointTrajectory | None:
    """Returns a short way to rest that keeps the accelerations; None where the motion itself rests earlier."""
    speed = np.abs(motion.at(at_ns)[1])
    steps = max(1, math.ceil(float((speed / max_acceleration_rad_s2).max()) * 1e9 / STEP_NS))
    while at_ns + steps * STEP_NS < motion.duration_ns:
        brake = _slowed(motion, at_ns, steps)
        if (extremes(brake)[1] <= max_acceleration_rad_s2).all():
            return brake
        steps += math.ceil(steps / 4)  # for the path's own bends
    return None


def _slowed(motion: JointTrajectory, at_ns: int, steps: int) -> JointTrajectory:
    """Returns the motion while the pace of its time falls evenly from 1 to 0, in which half as much of it passes."""
    pace = 1.0 - np.arange(steps + 1) / steps
    moments = at_ns + np.rint(0.5 * steps * STEP_NS * (1.0 - pace * pace)).astype(np.int64)
    states = _sampled(motion, moments.tolist())
    return JointTrajectory(
        times_ns=np.arange(steps + 1, dtype=np.int64) * STEP_NS,
        position_rad=states.position_rad,
        velocity_rad_s=states.velocity_rad_s * pace[:, None],
    )

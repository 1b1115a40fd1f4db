"""Smooth motions between tilt angles: jerk-limited in the angle, and in the joints by the tilt path.

The motion is planned in the tilt angle, a single number, and mapped to joints by a `TiltPath`; so the pivot rests
during the whole motion and the block feels no linear acceleration. A motion that would need much more joint travel
than its tilt explains is not planned at all (the arm would be swinging round).
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from shared.errors import UserError
from station.arm.profile import Bounds, Profile, TiltState, profile_to_angle, profile_to_rest
from station.arm.tilt_path import TiltPath
from station.rig.arm_model import ArmModel
from station.rig.arm_settings import LONGEST_TILT_S

Array = NDArray[np.float64]
PERIOD_NS = 10_000_000
_SMALLEST_STEP_RAD = 1e-6


@dataclass(frozen=True, kw_only=True)
class JointTrajectory:
    """Joint set-points over time: `times_ns` (m,) from 0, `position_rad` (m, n), `velocity_rad_s` (m, n)."""

    times_ns: NDArray[np.int64]
    position_rad: Array
    velocity_rad_s: Array

    @property
    def duration_ns(self) -> int:
        """The duration of the motion, ns."""
        return self._times[-1]

    @cached_property
    def _times(self) -> list[int]:
        """The times as plain numbers, which are found faster."""
        return self.times_ns.tolist()

    @cached_property
    def _end(self) -> tuple[Array, Array]:
        """The end of the motion, at rest."""
        return self.position_rad[-1], np.zeros_like(self.velocity_rad_s[-1])

    @cached_property
    def cubics(self) -> Array:
        """Coefficients of the cubic Hermite pieces, (m - 1, 4, n), in the share 0 to 1 of the piece's time."""
        h = np.diff(self.times_ns)[:, None] * 1e-9
        q0, q1 = self.position_rad[:-1], self.position_rad[1:]
        v0, v1 = self.velocity_rad_s[:-1] * h, self.velocity_rad_s[1:] * h
        return np.stack([q0, v0, 3 * (q1 - q0) - 2 * v0 - v1, v0 + v1 - 2 * (q1 - q0)], axis=1)

    def at(self, elapsed_ns: int) -> tuple[Array, Array]:
        """Returns the position and velocity (n,) at a time after the start; outside the motion its ends hold."""
        if elapsed_ns <= 0:
            return self.position_rad[0], self.velocity_rad_s[0]
        if elapsed_ns >= self._times[-1]:
            return self._end
        k = bisect_right(self._times, elapsed_ns) - 1
        began_ns, end_ns = self._times[k], self._times[k + 1]
        if began_ns == elapsed_ns:
            return self.position_rad[k], self.velocity_rad_s[k]
        h = (end_ns - began_ns) * 1e-9
        u = (elapsed_ns - began_ns) / (end_ns - began_ns)
        weights = np.array([[1.0, u, u * u, u * u * u], [0.0, 1 / h, 2 * u / h, 3 * u * u / h]])
        position, velocity = weights.dot(self.cubics[k])
        return position, velocity


@dataclass(frozen=True, kw_only=True)
class TiltLimits:
    """Limits of the tilt itself: the plate's rate, angular acceleration and jerk, and what one step may take.

    `max_travel` is joint travel in rad per rad of tilt; more means that the arm would swing round.
    `joint_share` is the share of a joint's own limits that a planned motion may use; `quickness_s` see `for_rate`.
    """

    max_rate_rad_s: float = math.radians(20.0)
    max_acceleration_rad_s2: float = 1.0
    max_jerk_rad_s3: float = 10.0
    max_travel: float = 12.0
    joint_share: float = 0.9
    quickness_s: float = 0.1

    def for_rate(self, rate_rad_s: float) -> TiltLimits:
        """Returns the limits of a motion at a rate: a fast one, such as the return, also gets up to its speed quickly.

        A measuring step is slow and stays gentle, lest a block off the pivot slip early by inertia; in a return a block
        that already slides should be stopped, before it reaches the border.
        """
        factor = max(1.0, rate_rad_s / self.quickness_s / self.max_acceleration_rad_s2)
        return replace(
            self,
            max_acceleration_rad_s2=factor * self.max_acceleration_rad_s2,
            max_jerk_rad_s3=factor * self.max_jerk_rad_s3,
        )


@dataclass(frozen=True, kw_only=True)
class TiltMotion:
    """A planned motion: the joints' trajectory, the profile of the angle that it came from, and where that ends."""

    path: TiltPath
    trajectory: JointTrajectory
    profile: Profile
    goal: TiltState

    def state(self, elapsed_ns: int) -> TiltState:
        """Returns the tilt at a time after the start."""
        seconds = elapsed_ns * 1e-9
        if seconds >= self.profile.duration_s:
            return self.goal
        angle, rate, acceleration = self.profile.at(seconds)
        return TiltState(angle_rad=float(angle), rate_rad_s=float(rate), acceleration_rad_s2=float(acceleration))


def plan_tilt(
    model: ArmModel, path: TiltPath, *, start: TiltState, angle_rad: float, rate_rad_s: float, limits: TiltLimits
) -> TiltMotion:
    """Plans the motion along `path` from `start` to rest at `angle_rad`, at most as fast as `rate_rad_s`.

    The rate is lowered where a joint could not keep up. Raises UserError when the angle is beyond the path's reach,
    the arm would swing round, or the motion would last longer than LONGEST_TILT_S.
    """
    if not (math.isfinite(angle_rad) and math.isfinite(rate_rad_s) and rate_rad_s > 0):
        raise UserError(f"Expected a finite angle and a positive rate, got {angle_rad} rad at {rate_rad_s} rad/s.")
    if not -_SMALLEST_STEP_RAD <= angle_rad <= path.reach_rad + _SMALLEST_STEP_RAD:
        raise UserError(
            f"The tilt of {math.degrees(angle_rad):.2f} degrees at azimuth {math.degrees(path.azimuth_rad):.1f} is out "
            f"of reach: it must lie between 0 and {math.degrees(path.reach_rad):.2f} degrees, where {path.limit}."
        )
    _refuse_swing(path, low=min(start.angle_rad, angle_rad), high=max(start.angle_rad, angle_rad), limits=limits)
    limits = limits.for_rate(rate_rad_s)
    bounds = _slowest_joint(model, path, start=start, angle_rad=angle_rad, limits=limits)
    bounds = bounds._replace(rate=min(bounds.rate, rate_rad_s))
    profile = profile_to_angle(start, angle_rad=angle_rad, bounds=bounds)
    if not profile.duration_s <= LONGEST_TILT_S:
        raise UserError(
            f"Expected a tilt that ends within {LONGEST_TILT_S:.0f} s, got one of {profile.duration_s:.3g} s at "
            f"{math.degrees(rate_rad_s):.3g} degrees/s: ask for a faster one."
        )
    goal = TiltState(angle_rad=angle_rad)
    return TiltMotion(path=path, trajectory=_joints(path, profile), profile=profile, goal=goal)


def plan_rest(path: TiltPath, *, start: TiltState, limits: TiltLimits) -> TiltMotion:
    """Plans to stop the tilt as soon as the limits allow, wherever that is."""
    bounds = Bounds(limits.max_rate_rad_s, limits.max_acceleration_rad_s2, limits.max_jerk_rad_s3)
    profile = profile_to_rest(start, bounds=bounds)
    goal = TiltState(angle_rad=float(profile.at(profile.duration_s)[0]))
    return TiltMotion(path=path, trajectory=_joints(path, profile), profile=profile, goal=goal)


def _refuse_swing(path: TiltPath, *, low: float, high: float, limits: TiltLimits) -> None:
    inside = (path.angles_rad >= low - 0.02) & (path.angles_rad <= high + 0.02)
    travel = float(np.abs(path.slopes[inside]).max(initial=0.0))
    if travel > limits.max_travel:
        raise UserError(
            f"The tilt at azimuth {math.degrees(path.azimuth_rad):.1f} degrees would swing the arm round: a joint "
            f"would turn {travel:.1f} times as far as the plate (at most {limits.max_travel:.1f})."
        )


def _slowest_joint(
    model: ArmModel, path: TiltPath, *, start: TiltState, angle_rad: float, limits: TiltLimits
) -> Bounds:
    """Returns rate, acceleration and jerk of the tilt that every joint can follow between two angles."""
    low, high = sorted((start.angle_rad, angle_rad))
    inside = (path.angles_rad >= low - 0.02) & (path.angles_rad <= high + 0.02)
    slope = np.maximum(np.abs(path.slopes[inside]).max(axis=0, initial=0.0), 1e-9)
    share = limits.joint_share
    rate = min(limits.max_rate_rad_s, share * float((model.max_velocity_rad_s / slope).min()))
    # The joints' acceleration is slope x angular acceleration + curvature x rate^2: each gets its part.
    bend = path.bends[inside] if len(path.angles_rad) > 1 else slope
    bend = np.maximum(bend.max(axis=0, initial=0.0), 1e-9)
    rate = min(rate, math.sqrt(0.5 * share * float((model.max_acceleration_rad_s2 / bend).min())))
    acceleration = min(
        limits.max_acceleration_rad_s2, 0.5 * share * float((model.max_acceleration_rad_s2 / slope).min())
    )
    jerk = min(limits.max_jerk_rad_s3, share * float((model.max_jerk_rad_s3 / slope).min()))
    return Bounds(rate, acceleration, jerk)


def _joints(path: TiltPath, profile: Profile) -> JointTrajectory:
    """Returns the profile sampled every `PERIOD_NS` and mapped to joints; the last sample is at rest."""
    count = max(1, math.ceil(profile.duration_s * 1e9 / PERIOD_NS)) + 1
    times_ns = np.arange(count, dtype=np.int64) * PERIOD_NS
    angles, rates, _ = profile.at(times_ns * 1e-9)
    rates[-1] = 0.0  # the profile ends with a rounding error
    position, slope = path.at(angles)
    return JointTrajectory(times_ns=times_ns, position_rad=position, velocity_rad_s=slope * rates[:, None])

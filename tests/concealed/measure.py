"""The onset of each run as the rig's own software would have estimated it, from what it saw and nothing else."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from station.friction.onset import estimate_onset
from tests.concealed.session import RunRecord
from tests.concealed.view import CENTRE_PX
from tests.concealed.world import BASE_HZ, World

Array = NDArray[np.float64]
EPOCH_NS = 1_790_000_000_000_000_000
_FITTED_K = 3 * BASE_HZ
_AVERAGED_K = round(0.3 * BASE_HZ)


def ns_of(k: float) -> int:
    """The station's clock at a substep."""
    return EPOCH_NS + round(k * 1_000_000_000 / BASE_HZ)


@dataclass(frozen=True, eq=False, kw_only=True)
class Reading:
    """The fields of a Sample that are estimated from the run's own signals."""

    slip_ns: int
    onset_rad: float
    onset_sigma_rad: float
    euler_rad: tuple[float, float, float]
    reference_px: Array
    variance_px2: Array
    post_px: Array
    bracket_rad: tuple[float, float]
    start: tuple[float, float, float]
    flags: tuple[str, ...]


def read_run(run: RunRecord, world: World) -> Reading:
    """Measures one run as `station run` does."""
    done = run.ride
    reference = _reference(run)
    mean, variance = reference.mean(axis=0), reference.var(axis=0, ddof=1)
    post = done.corners_px[done.found][-5:].mean(axis=0)
    detect = done.marks[1] if done.marks[1] >= 0 else done.marks[2]
    fitted = None if run.censored else _fit(run, world, float(np.sqrt(variance.mean())))
    averaged = (done.attitude_at >= detect - _AVERAGED_K) & (done.attitude_at <= detect)
    tilt = float(done.tilt[averaged].mean())
    flags: tuple[str, ...] = ("tipped",) if done.tipped else ()
    if fitted is not None:
        slip_ns, onset, sigma = fitted
        bracket = _bracket(run, slip_ns)
    else:
        slip_ns, onset = 0, tilt
        bracket = _bracket(run, ns_of(detect))
        sigma = 0.0 if run.censored else (bracket[1] - bracket[0]) / math.sqrt(12.0)
        flags = flags if run.censored else (*flags, "onset_unresolved")
    if run.censored:
        onset = float(done.truths[2])
    return Reading(
        slip_ns=slip_ns, onset_rad=onset, onset_sigma_rad=sigma, euler_rad=_euler(run.facts.azimuth, tilt),
        reference_px=mean, variance_px2=variance, post_px=post, bracket_rad=bracket, start=_place(mean, world),
        flags=flags,
    )  # fmt: skip


def _reference(run: RunRecord) -> Array:
    done = run.ride
    before = done.found & (done.frame_at <= done.marks[0])
    return done.corners_px[before][-10:]


def to_plate(corners_px: Array, world: World) -> Array:
    """Corners (..., 8) in metres on the plate (..., 4, 2), by the nominal view, the mark's height undone."""
    grow = world.px_per_m / (1.0 - world.mark_height / world.camera_height)
    points = (corners_px.reshape(*corners_px.shape[:-1], 4, 2) - CENTRE_PX) / grow
    return points * np.array([1.0, -1.0])


def _fit(run: RunRecord, world: World, sigma_px: float) -> tuple[int, float, float] | None:
    done = run.ride
    since = max(int(done.marks[0]), int(done.marks[1]) - _FITTED_K)
    late = round(world.late_s * BASE_HZ)
    chosen = done.found & (done.frame_at >= since) & (done.frame_at <= done.marks[1])
    attitudes = done.attitude_at >= since - 90
    if chosen.sum() < 8:
        return None
    path = to_plate(done.corners_px[chosen], world).mean(axis=1)
    slide = path[-1] - path[0]
    length = float(np.hypot(*slide))
    if length == 0.0:
        return None
    direction = slide / length
    down = np.array([math.sin(run.facts.azimuth), -math.cos(run.facts.azimuth)])
    found = estimate_onset(
        [ns_of(k + late) for k in done.frame_at[chosen]],
        (path - path[0]) @ direction,
        tilt_ns=[ns_of(k) for k in done.attitude_at[attitudes]],
        tilt_rad=done.tilt[attitudes],
        sigma_m=0.5 * sigma_px / world.px_per_m,
        along=max(0.2, float(direction @ down)),
        ahead_m=float(path[0] @ down),
    )
    return None if found is None else (found.slip_ns, found.angle_rad, found.angle_sigma_rad)


def _bracket(run: RunRecord, at_ns: int) -> tuple[float, float]:
    """The tilt step in which a moment fell."""
    before, target = 0.0, float(run.ride.step_angle[0])
    for times, angle in zip(run.ride.step_at, run.ride.step_angle, strict=True):
        if ns_of(times[1]) > at_ns:
            break
        before, target = (target, float(angle)) if angle != target else (before, target)
    return before, target


def _place(corners_px: Array, world: World) -> tuple[float, float, float]:
    """x, y (m) and yaw (rad) of a mark."""
    points = to_plate(corners_px, world)
    x, y = points.mean(axis=0)
    upper = 0.5 * (points[1] - points[0] + points[2] - points[3])
    return float(x), float(y), math.atan2(upper[1], upper[0])


def _euler(azimuth: float, tilt: float) -> tuple[float, float, float]:
    """Roll, pitch and yaw of a plate tilted about the level axis at `azimuth`."""
    c, s = math.cos(azimuth), math.sin(azimuth)
    cos_t, sin_t = math.cos(tilt), math.sin(tilt)
    roll = math.atan2(c * sin_t, cos_t)
    pitch = math.asin(max(-1.0, min(1.0, s * sin_t)))
    yaw = math.atan2(c * s * (1.0 - cos_t), cos_t + c * c * (1.0 - cos_t))
    return roll, pitch, yaw

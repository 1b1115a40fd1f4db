"""The steady streams of a session as packed messages: corners, fiducial, attitude, joints, another sensor."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tests.concealed.contact import gravity_of, true_tilt
from tests.concealed.measure import EPOCH_NS
from tests.concealed.packing import Bytes, Packer
from tests.concealed.session import START_K, SessionRecord
from tests.concealed.view import project, see_mark
from tests.concealed.world import ATTITUDE, BASE_HZ, FIDUCIAL, FRAME, SENSOR, RunFacts, World

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
BOOT_ID = 7
EXPOSURE_NS = 2_000_000
FIDUCIAL_PLACE_M = (-0.042, 0.042)
FIDUCIAL_SIDE_M = 0.004
PIVOT_M = (0.34, 0.0, 0.78)
JOINTS = ("gimbal_x", "gimbal_y")
_GRID_RAD = 2.0**-20
"""The encoders' step, 1 µrad; powers of two pack better than decimals."""
_GRID_PX = 2.0**-9
_GRID_QUATERNION = 2.0**-32
_ASKEW_RAD = 0.01
"""The standard deviation of a sensor's turn on the plate about each axis: by hand, to a little more than half a degree.
"""
_CAMERA_LATENCY_NS, _ARM_LATENCY_NS = 4_200_000, 700_000


@dataclass(frozen=True, eq=False)
class Stream:
    """Messages of one topic: when they were captured and received (ns), and their payloads, one row each."""

    topic: str
    publish_ns: Integers
    log_ns: Integers
    rows: Bytes


@dataclass(frozen=True, eq=False)
class _Frames:
    """All frames of a session; `gravity` (n, 2) is that along the plate over g."""

    at: Integers
    corners_px: Array
    found: NDArray[np.bool_]
    tips: NDArray[np.bool_]
    gravity: Array
    sigma_px: Array


def times_ns(at: Integers, *, late_s: float = 0.0) -> Integers:
    """The station's clock at substeps."""
    return EPOCH_NS + (at * 1_000_000_000) // BASE_HZ + round(late_s * 1e9)


def streams_of(session: SessionRecord, rng: Generator) -> list[Stream]:
    """Every steady stream of a session."""
    world, design = session.setting.world, session.setting.design
    frames = _frames(session, rng)
    attitude_at, tilt, rate, azimuth = _attitude(session)
    made = [
        *_corner_streams(frames, world.late_s),
        _fiducial_stream(frames, world, rng),
        _platform_stream(attitude_at, tilt, rate, azimuth),
        _joint_stream(attitude_at, tilt, rate, azimuth),
    ]
    if design.second_sensor:
        made.append(_sensor_stream(session, math.radians(design.sensor_noise_deg), rng))
    return made


# --- camera -----------------------------------------------------------------------------------------------------------


def _frames(session: SessionRecord, rng: Generator) -> _Frames:
    first = _sync_frames(session, rng)
    rides = [run.ride for run in session.runs]
    sigmas = [np.full(len(run.ride.frame_at), run.facts.sigma_px) for run in session.runs]
    return _Frames(
        at=np.concatenate([first.at, *(done.frame_at for done in rides)]),
        corners_px=np.concatenate([first.corners_px, *(done.corners_px for done in rides)]),
        found=np.concatenate([first.found, *(done.found for done in rides)]),
        tips=np.concatenate([first.tips, *(done.tips for done in rides)]),
        gravity=np.concatenate([first.gravity, *(done.down for done in rides)]),
        sigma_px=np.concatenate([first.sigma_px, *sigmas]),
    )


def _sync_frames(session: SessionRecord, rng: Generator) -> _Frames:
    """The block lies where the first run finds it while the plate makes its small move."""
    world = session.setting.world
    at = np.arange(FRAME, START_K, FRAME, dtype=np.int64)
    gravity = np.array([gravity_of(world, 0.0, true_tilt(world, tilt))[:2] for tilt in session.sync[at]])
    corners = np.zeros((len(at), 8))
    for i, (x, y) in enumerate(gravity):
        see_mark(world, session.runs[0].start, np.zeros(3), np.zeros(3), x, y, corners[i])
    sigma = session.runs[0].facts.sigma_px
    corners += sigma * rng.standard_normal(corners.shape)
    seen = np.ones(len(at), dtype=bool)
    return _Frames(at, corners, seen, ~seen, gravity, np.full(len(at), sigma))


def _corner_rows(frames: _Frames, chosen: NDArray[np.bool_], stamps: Integers, *, found: bool, tipped: bool) -> Bytes:
    packer = Packer(len(stamps)).stamp(1, stamps).small(2, np.flatnonzero(chosen) + 1)
    if found:
        sigma = np.round(frames.sigma_px[chosen], 3)
        packer.doubles(3, np.round(frames.corners_px[chosen] / _GRID_PX) * _GRID_PX).double(4, sigma).double(5, sigma)
    packer.small(6, EXPOSURE_NS).raw(7, bytes(4)).flag(8, found)
    if not found:
        packer.text(9, "no mark found")
    packer.small(11, BOOT_ID)
    return packer.flag(12, tipped).rows()


def _corner_streams(frames: _Frames, late_s: float) -> list[Stream]:
    """The block's marker: found, found tipping, not found. One topic, three lengths of message."""
    stamps = times_ns(frames.at, late_s=late_s)
    made: list[Stream] = []
    for found, tipped in ((True, False), (True, True), (False, False)):
        chosen = (frames.found == found) & ((frames.tips & frames.found) == tipped)
        if chosen.any():
            rows = _corner_rows(frames, chosen, stamps[chosen], found=found, tipped=tipped)
            made.append(Stream("camera/corners", stamps[chosen], stamps[chosen] + _CAMERA_LATENCY_NS, rows))
    return made


def _fiducial_stream(frames: _Frames, world: World, rng: Generator) -> Stream:
    chosen = frames.at % FIDUCIAL == 0
    stamps, gravity = times_ns(frames.at[chosen], late_s=world.late_s), frames.gravity[chosen]
    half, (x0, y0) = 0.5 * FIDUCIAL_SIDE_M, FIDUCIAL_PLACE_M
    corners = np.zeros((len(stamps), 8))
    for i, (sx, sy) in enumerate(((-1, 1), (1, 1), (1, -1), (-1, -1))):
        for row, (gx, gy) in enumerate(gravity):
            corners[row, 2 * i : 2 * i + 2] = project(world, x0 + sx * half, y0 + sy * half, 0.0, gx, gy)
    sigma = frames.sigma_px[chosen]
    corners += sigma[:, None] * rng.standard_normal(corners.shape)
    rows = (
        Packer(len(stamps))
        .stamp(1, stamps)
        .small(2, np.arange(1, len(stamps) + 1))
        .doubles(3, np.round(corners / _GRID_PX) * _GRID_PX)
        .double(4, np.round(sigma, 3))
        .double(5, np.round(sigma, 3))
        .small(6, EXPOSURE_NS)
        .raw(7, bytes(4))
        .flag(8, True)
        .small(10, 1)
        .small(11, BOOT_ID)
        .rows()
    )
    return Stream("camera/plate", stamps, stamps + _CAMERA_LATENCY_NS, rows)


# --- arm --------------------------------------------------------------------------------------------------------------


def _attitude(session: SessionRecord) -> tuple[Integers, Array, Array, Array]:
    """Returns the times of the readings, the reported tilt, its rate, and the azimuth of its axis."""
    first = np.arange(0, START_K, ATTITUDE, dtype=np.int64)
    rides = [run.ride for run in session.runs]
    sync_rate = np.gradient(session.sync) * BASE_HZ
    azimuths = [np.full(len(run.ride.attitude_at), run.facts.azimuth) for run in session.runs]
    tilt = np.concatenate([session.sync[first], *(done.tilt for done in rides)])
    return (
        np.concatenate([first, *(done.attitude_at for done in rides)]),
        np.round(tilt / _GRID_RAD) * _GRID_RAD,
        np.round(np.concatenate([sync_rate[first], *(done.tilt_rate for done in rides)]) / _GRID_RAD) * _GRID_RAD,
        np.concatenate([np.zeros(len(first)), *azimuths]),
    )


def _platform_stream(at: Integers, tilt: Array, rate: Array, azimuth: Array) -> Stream:
    stamps = times_ns(at)
    axis = np.stack([np.cos(azimuth), np.sin(azimuth)])
    packer = Packer(len(at)).stamp(1, stamps).double(2, _rounded(np.cos(0.5 * tilt)))
    packer.double(3, _rounded(np.sin(0.5 * tilt) * axis[0])).double(4, _rounded(np.sin(0.5 * tilt) * axis[1]))
    packer.double(6, _rounded(rate * axis[0])).double(7, _rounded(rate * axis[1]))
    for field, value in zip((9, 10, 11), PIVOT_M, strict=True):
        packer.double(field, value)
    return Stream("arm/platform", stamps, stamps + _ARM_LATENCY_NS, packer.text(12, "world").rows())


def _rounded(values: Array) -> Array:
    return np.round(values / _GRID_QUATERNION) * _GRID_QUATERNION


def _joint_stream(at: Integers, tilt: Array, rate: Array, azimuth: Array) -> Stream:
    """A gimbal's two joints that give this attitude: about x, then about the turned y, to first order in rates."""
    stamps = times_ns(at)
    c, s = np.cos(azimuth), np.sin(azimuth)
    roll, pitch = np.arctan2(c * np.sin(tilt), np.cos(tilt)), np.arcsin(s * np.sin(tilt))
    packer = Packer(len(at)).stamp(1, stamps).text(2, JOINTS[0]).text(2, JOINTS[1])
    grid = _GRID_RAD
    packer.doubles(3, np.round(np.column_stack([roll, pitch]) / grid) * grid)
    packer.doubles(4, np.round(np.column_stack([rate * c, rate * s]) / grid) * grid).doubles(5, np.zeros((len(at), 2)))
    return Stream("arm/joints", stamps, stamps + _ARM_LATENCY_NS, packer.rows())


def _sensor_stream(session: SessionRecord, noise_rad: float, rng: Generator) -> Stream:
    """An inertial sensor, put on the plate by hand: it feels gravity itself, whatever the arm reports."""
    world = session.setting.world
    rows: list[tuple[int, float, float, float]] = []
    for at in range(0, START_K, SENSOR):
        rows.append((at, *gravity_of(world, 0.0, true_tilt(world, session.sync[at]))))
    for run in session.runs:
        facts: RunFacts = run.facts
        for at, tilt in zip(run.ride.reading_at, run.ride.reading_tilt, strict=True):
            rows.append((int(at), *gravity_of(world, facts.azimuth, tilt)))
    table = np.array(rows)
    stamps, gravity = times_ns(table[:, 0].astype(np.int64)), table[:, 1:]
    gravity = gravity + noise_rad * rng.standard_normal(gravity.shape)
    gravity = Rotation.from_rotvec(_ASKEW_RAD * rng.standard_normal(3)).apply(gravity)
    gravity = np.round(gravity / np.linalg.norm(gravity, axis=1, keepdims=True) / _GRID_RAD) * _GRID_RAD
    angle = np.arctan2(np.hypot(gravity[:, 0], gravity[:, 1]), -gravity[:, 2])
    packer = Packer(len(stamps)).stamp(1, stamps).text(2, "imu").double(3, angle)
    for field in range(3):
        packer.double(4 + field, gravity[:, field])
    return Stream("angle/imu", stamps, stamps + 2_000_000, packer.double(7, noise_rad).rows())

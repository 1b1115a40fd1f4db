"""The agents of arm and camera report readings of the bench with the errors of the world's sensors."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from shared.messages import AngleReading, JointState, MarkerCorners, PlatformState
from tests.proof.patch_world import places as at
from tests.proof.patch_world.bench import Bench
from tests.proof.patch_world.rig import Joints
from tests.proof.patch_world.world import Camera, Contact, Sensing

INCLINOMETER = "inclinometer"
_INCLINOMETER_SD_RAD = math.radians(0.05)
_SHARED = np.array([8, 9] * 4)
"""The two numbers that all four corners share."""


def attitude(
    bench: Bench, sensing: Sensing, pivot_m: Sequence[float], *, stamp_ns: int, rng: np.random.Generator
) -> PlatformState:
    """The plate's attitude as the encoders have it: gain, offset, step and noise, and rates that may be filtered."""
    azimuth = bench.motion[at.AZIMUTH]
    angle = sensing.gain * bench.state[at.MEASURED] + sensing.offset_rad
    if sensing.step_rad:
        angle = round(angle / sensing.step_rad) * sensing.step_rad
    rate = sensing.gain * bench.state[at.MEASURED_RATE]
    noise = rng.standard_normal(6)
    x, y, z = sensing.noise_rad * noise[:3] + (angle * math.cos(azimuth), angle * math.sin(azimuth), 0.0)
    turn = math.sqrt(x * x + y * y + z * z)
    share = math.sin(0.5 * turn) / turn if turn > 1e-12 else 0.5
    wx, wy, wz = sensing.rate_noise_rad_s * noise[3:] + (rate * math.cos(azimuth), rate * math.sin(azimuth), 0.0)
    return PlatformState(
        stamp_ns=stamp_ns,
        qw=math.cos(0.5 * turn), qx=float(share * x), qy=float(share * y), qz=float(share * z),
        wx=float(wx), wy=float(wy), wz=float(wz),
        px=pivot_m[0], py=pivot_m[1], pz=pivot_m[2],
        frame_id="world",
    )  # fmt: skip


def joints(bench: Bench, sensing: Sensing, arm: Joints, *, stamp_ns: int) -> JointState:
    """The joints' angles that belong to the attitude as the encoders have it."""
    angle = sensing.gain * bench.state[at.MEASURED] + sensing.offset_rad
    position, slopes = arm.at(angle, azimuth=float(bench.motion[at.AZIMUTH]))
    return JointState(
        stamp_ns=stamp_ns,
        name=arm.names,
        position_rad=tuple(position.tolist()),
        velocity_rad_s=tuple((slopes * bench.state[at.MEASURED_RATE]).tolist()),
    )


def inclination(bench: Bench, *, stamp_ns: int, rng: np.random.Generator) -> AngleReading:
    """The reading of an inclinometer on the plate, against true gravity as the sensor is turned."""
    azimuth, angle = float(bench.motion[at.AZIMUTH]), float(bench.state[at.ANGLE])
    level = gravity_in_plate(bench.world.contact, azimuth=azimuth, angle=angle)
    gravity = np.array([*level, -math.sqrt(1 - level @ level)])
    felt = Rotation.from_rotvec(bench.world.sensing.askew_rad).apply(gravity)[:2]
    x, y = felt + _INCLINOMETER_SD_RAD * rng.standard_normal(2)
    down = math.sqrt(max(1 - x * x - y * y, 0.0))
    return AngleReading(
        stamp_ns=stamp_ns,
        source=INCLINOMETER,
        angle_rad=math.atan2(math.hypot(x, y), down),
        gravity_x=float(x),
        gravity_y=float(y),
        gravity_z=-down,
        sigma_rad=_INCLINOMETER_SD_RAD,
    )


def gravity_in_plate(contact: Contact, *, azimuth: float, angle: float) -> np.ndarray:
    """The first two components of gravity's unit vector in the plate (2), with the level's error; see `plate.loads`."""
    ax, ay = math.cos(azimuth), math.sin(azimuth)
    level = np.array([contact.lean_x, contact.lean_y])
    down = math.sqrt(1.0 - level @ level)
    along = (ax * level[0] + ay * level[1]) * (1 - math.cos(angle))
    return math.cos(angle) * level + math.sin(angle) * down * np.array([ay, -ax]) + along * np.array([ax, ay])


def frame(
    seen: list[float],
    camera: Camera,
    *,
    capture_ns: int,
    seq: int,
    marker: int,
    rng: np.random.Generator,
    exposure_ns: int = 2_000_000,
) -> MarkerCorners:
    """A frame's corners: noise of each corner, of all four together, a wrong corner at times, or no mark at all."""
    sigma = math.hypot(camera.pixel_sd, camera.pose_sd_px)
    luck = rng.random(3)
    if marker == 0 and luck[0] < camera.unseen_share:
        return MarkerCorners(
            capture_ns=capture_ns,
            seq=seq,
            sigma_px=sigma,
            exposure_ns=exposure_ns,
            reason="no dark square in the window",
            marker_id=marker,
        )
    noise = rng.standard_normal(10)
    corners = np.asarray(seen) + camera.pixel_sd * noise[:8] + camera.pose_sd_px * noise[_SHARED]
    if marker == 0 and luck[1] < camera.outlier_share:
        corner = 2 * int(4 * luck[2])
        corners[corner : corner + 2] += camera.outlier_px * rng.standard_normal(2)
    return MarkerCorners(
        capture_ns=capture_ns, seq=seq, corners_px=tuple(corners.tolist()), sigma_px=sigma, residual_px=sigma,
        exposure_ns=exposure_ns, corner_dt_ns=(0, 0, 0, 0), found=True, marker_id=marker,
    )  # fmt: skip

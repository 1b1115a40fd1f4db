"""A session as other rigs would have recorded it: what drivers, cheap servos and hands do to signals."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from shared.geometry import Array
from station.signals.session import Signals
from station.signals.tracks import AttitudeTrack, Times, Track

NANO = 1e9
SERVO_RAD = np.radians(0.088)
"""The step of a servo with 4096 positions a turn."""

Rig = Callable[[Signals], Signals]


def _as_it_is(signals: Signals) -> Signals:
    return signals


def _rotations(attitude: AttitudeTrack) -> Rotation:
    return Rotation.from_quat(np.roll(attitude.quaternion, -1, axis=1))


def _attitude(signals: Signals, **changed: Array | Times) -> Signals:
    return replace(signals, attitude=replace(signals.attitude, **changed))


def _angles(signals: Signals, track: str, make: Callable[[Array], Array]) -> Signals:
    changed = {source: replace(one, **{track: make(getattr(one, track))}) for source, one in signals.angles.items()}
    return replace(signals, angles=changed)


def _every(signals: Signals, count: int) -> Signals:
    attitude = signals.attitude
    return replace(signals, attitude=attitude.select(np.arange(len(attitude)) % count == 0))


def _jittered(track: Track, sd_s: float) -> Times:
    late = np.round(sd_s * NANO * np.random.default_rng(20261129).standard_normal(len(track))).astype(np.int64)
    return np.sort(track.time_ns + late)


def _without_rates(signals: Signals) -> Signals:
    return _attitude(signals, rate_rad_s=np.zeros_like(signals.attitude.rate_rad_s))


def _in_steps(signals: Signals) -> Signals:
    turns = _rotations(signals.attitude).as_rotvec()
    stepped = Rotation.from_rotvec(np.round(turns / SERVO_RAD) * SERVO_RAD).as_quat()
    return _attitude(_without_rates(signals), quaternion=np.roll(stepped, 1, axis=1))


def _hobby_arm(signals: Signals) -> Signals:
    """Thirty attitudes a second in steps of a servo, no rates, and no other sensor."""
    return replace(_in_steps(_every(signals, 3)), angles={})


def _said_again(signals: Signals) -> Signals:
    last = np.arange(len(signals.attitude)) // 4 * 4
    return _attitude(
        signals, quaternion=signals.attitude.quaternion[last], rate_rad_s=signals.attitude.rate_rad_s[last]
    )


def _turned_against_the_camera(signals: Signals) -> Signals:
    turn = Rotation.from_euler("z", 3.0, degrees=True)
    quaternion = np.roll((_rotations(signals.attitude) * turn).as_quat(), 1, axis=1)
    return _attitude(signals, quaternion=quaternion, rate_rad_s=turn.inv().apply(signals.attitude.rate_rad_s))


def _askew(signals: Signals) -> Signals:
    turn = Rotation.from_rotvec(np.radians([0.6, -0.8, 2.0]))
    turned = _angles(signals, "gravity", turn.apply)
    changed = {
        source: replace(one, angle_rad=np.arctan2(np.hypot(one.gravity[:, 0], one.gravity[:, 1]), -one.gravity[:, 2]))
        for source, one in turned.angles.items()
    }
    return replace(turned, angles=changed)


def _late_sensor(signals: Signals) -> Signals:
    return _angles(signals, "time_ns", lambda time_ns: time_ns + round(0.015 * NANO))


def _thirty_frames(signals: Signals) -> Signals:
    return replace(signals, corners=signals.corners.select(np.arange(len(signals.corners)) % 3 == 0))


def _frames_jitter(signals: Signals) -> Signals:
    return replace(signals, corners=replace(signals.corners, time_ns=_jittered(signals.corners, 1e-3)))


def _attitudes_jitter(signals: Signals) -> Signals:
    return _attitude(signals, time_ns=_jittered(signals.attitude, 3e-3))


RIGS: Mapping[str, Rig] = {
    "as it is": _as_it_is,
    "the sensor askew by 1°, turned by 2°": _askew,
    "the sensor 15 ms late": _late_sensor,
    "no other sensor": lambda signals: replace(signals, angles={}),
    "no fiducials": lambda signals: replace(signals, fiducials={}),
    "25 attitudes a second": lambda signals: _every(signals, 4),
    "each attitude said four times": _said_again,
    "no rates": _without_rates,
    "rates in degrees": lambda signals: _attitude(signals, rate_rad_s=np.degrees(signals.attitude.rate_rad_s)),
    "no rates, steps of .088°": _in_steps,
    "a hobby arm": _hobby_arm,
    "attitudes' stamps jitter by 3 ms": _attitudes_jitter,
    "the plate turned by 3° against the camera": _turned_against_the_camera,
    "30 frames a second": _thirty_frames,
    "frames' stamps jitter by 1 ms": _frames_jitter,
}

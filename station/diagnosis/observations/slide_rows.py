"""Builds the sliding channels: every slide of a session, cut into windows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.observations.channel import Channel, Rows, rows_of
from station.diagnosis.observations.directions import Believed, believed
from station.diagnosis.observations.driving import driving
from station.diagnosis.observations.moments import Moments
from station.diagnosis.observations.onsets import Onsets
from station.diagnosis.observations.plate import PlateMotion, Times
from station.diagnosis.observations.slides import LEAST_M_S, Across, Along, Motion, Turn
from station.diagnosis.observations.tracks import RunTrack
from station.diagnosis.observations.views import block_view
from station.diagnosis.observations.windows import FINE_NODES, NODES, WEIGHTS, Window, windows_of
from station.physics.contact import GRAVITY_M_S2, Array, Contact, View
from station.physics.covariates import covariates_of
from station.physics.sole import SQUARE_GYRATION, TURNING_RADIUS

if TYPE_CHECKING:
    from station.diagnosis.observations.build import Recorded

LEAST_MU = 0.15
"""The smallest coefficient by which residuals are divided; measured friction is several times larger."""

LEAST_SLOPE_RAD = 0.05
"""A plate more level than this has no steepest line."""


def free_windows(recorded: Recorded) -> Sequence[tuple[int, Window]]:
    """The windows of slides with the block clear of the foam, wherever it lay before, each with its run's place."""
    return [
        (place, window)
        for place, track in enumerate(recorded.tracks)
        for window in windows_of(track)
        if recorded.setting.free_m(track.pose[window.frames]).min() > thresholds.FREE_M
    ]


def slide_channels(recorded: Recorded, onsets: Onsets | None) -> Sequence[Channel]:
    """The channels along, across and turn, from all windows in which the block is clear of the foam."""
    if not recorded.windows:
        return []
    places, windows = [place for place, _ in recorded.windows], [window for _, window in recorded.windows]
    runs = np.array(places, dtype=np.int64)
    tracks = [recorded.tracks[place] for place in places]
    nodes = len(WEIGHTS)
    node_ns = np.concatenate([window.node_ns for window in windows])
    pose = np.concatenate([window.node_pose for window in windows])
    down, deviation = _directions(windows, recorded, runs)
    moments = Moments(
        time_ns=node_ns,
        run=np.repeat(runs, nodes),
        facts=recorded.facts,
        attitude=lambda delay_s: recorded.plate.at(node_ns, delay_s=delay_s),
        place_m=pose[:, :2],
        yaw_rad=pose[:, 2],
        velocity_m_s=_velocities(windows, down + deviation.off_rad),
        moving=np.ones(len(node_ns), dtype=np.bool_),
        slip_ns=np.repeat(np.array([track.slip_ns for track in tracks], dtype=np.int64), nodes),
        border_m=np.concatenate([recorded.setting.free_m(window.node_pose) for window in windows]),
        rested_s=np.repeat(recorded.rested.typical()[runs], nodes),
    )
    motion = Motion(
        moments,
        np.array([window.acceleration_m_s2 for window in windows]),
        np.array([window.yaw_acceleration_rad_s2 for window in windows]),
        None if onsets is None else lambda model: _of_runs(onsets.drawn(model, len(recorded.tracks)), runs),
        np.concatenate([window.node_yaw_rate_rad_s for window in windows]),
        _between(windows, recorded.plate),
        _seen(recorded, windows, moments.reported),
    )
    contact = moments.reported
    middle = {name: values[1::nodes] for name, values in covariates_of(contact).items()}
    # The yaw is that before the slide: a window's own shares the noise of the turning that it is to explain.
    yaw = np.array([_resting_yaw(track) for track in tracks])
    middle |= {"yaw": yaw, "slide_to_block": contact.way_rad[1::nodes] - yaw}
    pressing = contact.pressing_m_s2[1::nodes]
    mu = max(float(np.median(np.tan(contact.tilt_rad))), LEAST_MU)
    noise = np.array(
        [
            math.hypot(window.acceleration_factor * track.sigma_m, GRAVITY_M_S2 * _leaning_rad(window, recorded.plate))
            for window, track in zip(windows, tracks, strict=True)
        ]
    )
    # Friction against the turning is as uncertain as the yaw's rate, the more the slower the block slides.
    slowing = TURNING_RADIUS**2 / SQUARE_GYRATION * pressing * mu / np.maximum(contact.speed_m_s[1::nodes], LEAST_M_S)
    turning = np.array(
        [
            math.hypot(window.acceleration_factor, rate * window.velocity_factor) * track.sigma_rad
            for window, track, rate in zip(windows, tracks, slowing.tolist(), strict=True)
        ]
    )

    def rows(sigma: Array) -> Rows:
        stretch = {
            "from_ns": np.array([window.from_ns for window in windows]),
            "to_ns": np.array([window.to_ns for window in windows]),
        }
        return rows_of({"run": runs, "sigma": sigma, **stretch}, middle)

    relative = noise / (pressing * mu)
    return [
        Along(rows(relative), motion),
        # A direction that is off by its own error puts that share of the friction across.
        Across(rows(np.hypot(relative, deviation.sigma_rad)), motion),
        Turn(rows(turning), motion),
    ]


def _seen(recorded: Recorded, windows: Sequence[Window], contact: Contact) -> View:
    """The camera's view of the windows' nodes (3 n)."""
    return block_view(
        recorded,
        np.concatenate([window.node_pose for window in windows]),
        velocity_m_s=np.concatenate([window.node_velocity for window in windows]),
        yaw_rate_rad_s=np.concatenate([window.node_yaw_rate_rad_s for window in windows]),
        tilt_rad=contact.tilt_rad,
        down_rad=contact.down_rad,
        rest_s=contact.slid_s,
    )


def _directions(windows: Sequence[Window], recorded: Recorded, runs: Times) -> tuple[Array, Believed]:
    """The direction down the slope at the nodes (n, 3), rad, and the slides' expected deviations from it."""
    plate = recorded.plate.at(np.concatenate([window.node_ns for window in windows]))
    down = plate.down_rad.reshape(len(windows), len(NODES))
    way = np.array([window.node_way_rad for window in windows])
    off = np.mod(way - down + np.pi, 2 * np.pi) - np.pi
    yaw = np.array([window.node_pose[:, 2] for window in windows])
    angles = (down, down - recorded.facts.mount_rad[runs][:, None], down - yaw)
    found = believed(off, np.array([window.way_sigma_rad for window in windows]), angles)
    level = plate.tilt_rad.reshape(down.shape) < LEAST_SLOPE_RAD
    return down, replace(found, off_rad=np.where(level, off, found.off_rad))


def _velocities(windows: Sequence[Window], way_rad: Array) -> Array:
    """Velocities at the nodes (3 n, 2), m/s: the windows' own speeds in directions (n, 3), rad."""
    velocity = np.array([window.node_velocity for window in windows])
    speed = np.hypot(velocity[..., 0], velocity[..., 1])
    return np.stack([speed * np.cos(way_rad), speed * np.sin(way_rad)], axis=-1).reshape(-1, 2)


def _between(windows: Sequence[Window], plate: PlateMotion) -> Array:
    """The means of pull and press over each window less those at the nodes (n, 3), m/s²."""
    middle = np.array([(window.from_ns + window.to_ns) // 2 for window in windows])
    half = np.array([0.5 * (window.to_ns - window.from_ns) for window in windows])
    places = np.array([window.node_pose[:, :2] for window in windows])
    velocities = np.array([window.node_velocity for window in windows])

    def mean(nodes: Array, weights: Array) -> Array:
        time_ns = (middle[:, None] + np.round(half[:, None] * nodes).astype(np.int64)).ravel()
        place, velocity = (_carried(values, nodes) for values in (places, velocities))
        load = driving(plate.at(time_ns), place, velocity) * (1.0, 1.0, -1.0)
        return (load.reshape(len(windows), len(nodes), 3) * weights[..., None]).sum(axis=1)

    fine = np.array([window.weight for window in windows])
    return mean(FINE_NODES, fine) - mean(NODES, WEIGHTS)


def _carried(values: Array, nodes: Array) -> Array:
    """Values (n, 3, 2) at the windows' nodes, extrapolated by a straight line to other nodes (k,): (n k, 2)."""
    slope = (values[:, -1] - values[:, 0]) / (NODES[-1] - NODES[0])
    return (values.mean(axis=1)[:, None] + slope[:, None] * nodes[None, :, None]).reshape(-1, 2)


def _leaning_rad(window: Window, plate: PlateMotion) -> float:
    """Standard deviation of gravity's mean direction over a window, rad, by the attitude's noise."""
    return plate.mean_sigma_rad(window.weight, 1e-9 * (window.to_ns - window.from_ns))


def _of_runs(values: tuple[Array, Array], runs: Times) -> tuple[Array, Array]:
    return values[0][runs], values[1][runs]


def _resting_yaw(track: RunTrack) -> float:
    frames = track.frames(track.level_ns, track.slip_ns)
    return float(np.median(track.pose[frames, 2])) if frames.stop > frames.start else track.sample.start_yaw_rad

"""Builds the sliding channels: every slide of a session, cut into windows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from station.diagnosis.observations.channel import Channel, rows_of
from station.diagnosis.observations.directions import ExpectedDirections, expected_directions
from station.diagnosis.observations.driving import driving
from station.diagnosis.observations.expected_path import expected_path
from station.diagnosis.observations.moments import Moments
from station.diagnosis.observations.onsets import Onsets
from station.diagnosis.observations.plate import PlateMotion, Times
from station.diagnosis.observations.slides import LEAST_M_S, LEAST_SLOPE_RAD, Across, Along, Motion, Turn
from station.diagnosis.observations.tracks import RunTrack
from station.diagnosis.observations.turning import expected_rates
from station.diagnosis.observations.views import block_view
from station.diagnosis.observations.window_frames import WindowFrames
from station.diagnosis.observations.windows import FINE_NODES, FRAMES, NODES, WEIGHTS, Windows
from station.physics.contact import GRAVITY_M_S2, Array, Contact, View
from station.physics.covariates import covariates_of
from station.physics.sole import SQUARE_GYRATION, TURNING_RADIUS

if TYPE_CHECKING:
    from station.diagnosis.observations.build import Recorded

LEAST_MU = 0.15
"""The smallest coefficient by which residuals are divided; measured friction is several times larger."""
A_CUBES_LEAD = 0.5
"""The lead of the pressure under a cube, in widths of its sole, over its friction: its mass is half its width up."""


def slide_channels(recorded: Recorded, onsets: Onsets | None) -> Sequence[Channel]:
    """Returns the channels along, across and turn, from all windows in which the block is clear of the foam."""
    windows, nodes = recorded.free_windows, len(WEIGHTS)
    if not len(windows):
        return []
    runs, node_ns = windows["run"], windows["node_ns"].ravel()
    tracks, count = [recorded.tracks[run] for run in runs], len(recorded.tracks)
    pose = windows["node_pose"].reshape(-1, 3)
    speed, sigma_rad = _speeds(windows), np.array([track.sigma_rad for track in tracks])
    rate_rad_s, rate_sigma = expected_rates(
        windows["node_yaw_rate_rad_s"], windows["velocity_factor"] * sigma_rad, speed, runs
    )
    down, deviation = _directions(recorded, rate_rad_s / np.maximum(speed, LEAST_M_S))
    plate = recorded.plate
    uneven = np.repeat(_uneven(windows, plate), nodes, axis=0)
    moments = Moments(
        time_ns=node_ns,
        run=np.repeat(runs, nodes),
        facts=recorded.facts,
        attitude=lambda delay_s: plate.at(node_ns, delay_s=delay_s).quickened(uneven),
        place_m=pose[:, :2],
        yaw_rad=pose[:, 2],
        velocity_m_s=_velocities(windows, down + deviation.off_rad),
        moving=np.ones(len(node_ns), dtype=np.bool_),
        slip_ns=np.repeat(np.array([track.slip_ns for track in tracks], dtype=np.int64), nodes),
        border_m=recorded.setting.free_m(pose),
        rest_s=np.repeat(recorded.dwell_by_tilt.typical()[runs], nodes),
        evened=_at_frames(recorded).evened,
    )
    contact = moments.reported
    motion = Motion(
        moments,
        windows["acceleration_m_s2"],
        windows["yaw_acceleration_rad_s2"],
        None if onsets is None else lambda model: _of_runs(onsets.run_effects(model, count), runs),
        rate_rad_s.ravel(),
        _between(windows, plate, uneven),
        _seen(recorded, moments, rate_rad_s.ravel()),
        (down + deviation.common_rad).ravel(),
    )
    middle = {name: values[1::nodes] for name, values in covariates_of(contact).items()}
    # The yaw is that before the slide: a window's own shares the noise of the turning that it is to explain.
    yaw = np.array([_resting_yaw(track) for track in tracks])
    # Its own way is set by its turning, too: where all slides go along one axis that is all by which the angles differ.
    middle |= {"yaw": yaw, "slide_to_block": down[:, len(WEIGHTS) // 2] - yaw}
    span = {name: windows[name] for name in ("run", "from_ns", "to_ns")}
    relative, carried, turning = _sigmas(recorded, contact, sigma_rad, rate_sigma)
    return [
        Along(rows_of({**span, "sigma": relative}, middle), motion),
        # A direction that is off by its own error puts that share of the friction across.
        Across(rows_of({**span, "sigma": np.hypot(np.hypot(relative, carried), deviation.sigma_rad)}, middle), motion),
        Turn(rows_of({**span, "sigma": turning}, middle), motion),
    ]


def _sigmas(recorded: Recorded, contact: Contact, yaw_rad: Array, rate_rad_s: Array) -> tuple[Array, Array, Array]:
    """Gives standard deviations (n,) of friction along and of that carried across, relative, and of turning, rad/s².

    Of the yaw in one frame it is `yaw_rad` (n,), of the rate of turning `rate_rad_s` (n,).
    """
    windows, middle = recorded.free_windows, slice(1, None, len(WEIGHTS))
    tracks = [recorded.tracks[run] for run in windows["run"]]
    pressing = contact.pressing_m_s2[middle]
    mu = max(float(np.median(np.tan(contact.tilt_rad))), LEAST_MU)
    acceleration = windows["acceleration_factor"] * np.array([track.sigma_m for track in tracks])
    # Gravity's mean direction over a window has the error of the attitude's noise.
    leaning_rad = [
        recorded.plate.mean_sigma_rad(window["weight"], 1e-9 * (window["to_ns"] - window["from_ns"]))
        for window in windows
    ]
    noise = np.hypot(acceleration, GRAVITY_M_S2 * np.array(leaning_rad))
    # Friction against the turning, and what it carries across, are as uncertain as the yaw's rate over the speed.
    uncertain = rate_rad_s / np.maximum(contact.speed_m_s[middle], LEAST_M_S)
    carried = A_CUBES_LEAD * mu * np.sqrt(contact.area_m2[middle]) * uncertain
    slowing = TURNING_RADIUS**2 / SQUARE_GYRATION * pressing * mu * uncertain
    turning = np.hypot(windows["acceleration_factor"] * yaw_rad, slowing)
    return noise / (pressing * mu), carried, turning


def _seen(recorded: Recorded, moments: Moments, rate_rad_s: Array) -> View:
    """Returns the camera's view of the windows' nodes (3 n,) on their expected path.

    Blocks turn at `rate_rad_s` (3 n,).
    """
    windows, contact = recorded.free_windows, moments.reported
    place_m, velocity_m_s, acceleration_m_s2 = expected_path(windows, moments.plain)
    return block_view(
        recorded,
        np.column_stack([place_m, contact.yaw_rad]),
        velocity_m_s=velocity_m_s,
        acceleration_m_s2=acceleration_m_s2,
        yaw_rate_rad_s=rate_rad_s,
        tilt_rad=contact.tilt_rad,
        down_rad=contact.down_rad,
        rest_s=contact.slid_s,
    )


def _directions(recorded: Recorded, turn_rad_m: Array) -> tuple[Array, ExpectedDirections]:
    """Returns the direction down the slope at the nodes (n, 3), rad, and the slides' expected deviations from it."""
    windows = recorded.free_windows
    plate = recorded.plate.at(windows["node_ns"].ravel())
    down = plate.down_rad.reshape(-1, len(NODES))
    off = np.mod(windows["node_way_rad"] - down + np.pi, 2 * np.pi) - np.pi
    angles = (down, down - recorded.facts.mount_rad[windows["run"]][:, None], down - windows["node_pose"][..., 2])
    turning = turn_rad_m * np.sqrt(recorded.facts.area_m2[windows["run"]])[:, None]
    found = expected_directions(off, windows["way_sigma_rad"], angles, windows["run"], turning=turning)
    level = plate.tilt_rad.reshape(down.shape) < LEAST_SLOPE_RAD
    off_rad, common_rad = (np.where(level, off, expected) for expected in (found.off_rad, found.common_rad))
    return down, replace(found, off_rad=off_rad, common_rad=common_rad)


def _speeds(windows: Windows) -> Array:
    """Returns the blocks' speeds at the nodes (n, 3), m/s."""
    return np.hypot(windows["node_velocity"][..., 0], windows["node_velocity"][..., 1])


def _velocities(windows: Windows, way_rad: Array) -> Array:
    """Returns velocities at the nodes (3 n, 2), m/s: the windows' own speeds in directions (n, 3), rad."""
    speed = _speeds(windows)
    return np.stack([speed * np.cos(way_rad), speed * np.sin(way_rad)], axis=-1).reshape(-1, 2)


def _uneven(windows: Windows, plate: PlateMotion) -> Array:
    """Returns the plate's mean acceleration over each window less that at the nodes (n, 3), rad/s².

    A plate that is set in motion or stopped has corners there, which three points do not show.
    """

    def mean(nodes: Array, weights: Array) -> Array:
        found = plate.at(_moments_ns(windows, nodes)).acceleration_rad_s2
        return (found.reshape(len(windows), len(nodes), 3) * weights[..., None]).sum(axis=1)

    return mean(FINE_NODES, windows["weight"]) - mean(NODES, WEIGHTS)


def _at_frames(recorded: Recorded) -> WindowFrames:
    """Returns the windows at their frames, for the plate's motion alone: the blocks stay at the plate's middle."""
    windows, plate, facts = recorded.free_windows, recorded.plate, recorded.facts

    def make() -> Moments:
        time_ns, run = windows["frame_ns"].ravel(), np.repeat(windows["run"], FRAMES)
        return Moments(
            time_ns=time_ns, run=run, facts=facts, attitude=lambda delay_s: plate.at(time_ns, delay_s=delay_s)
        )

    return WindowFrames(make, windows["curvature"])


def _moments_ns(windows: Windows, nodes: Array) -> Times:
    """Returns the times (n k,), ns, of nodes (k,), from −1 to 1, in each window."""
    middle, half = (windows["from_ns"] + windows["to_ns"]) // 2, 0.5 * (windows["to_ns"] - windows["from_ns"])
    return (middle[:, None] + np.round(half[:, None] * nodes).astype(np.int64)).ravel()


def _between(windows: Windows, plate: PlateMotion, uneven: Array) -> Array:
    """Returns the means of pull and press over each window less those at the nodes (n, 3), m/s²."""
    places, velocities = windows["node_pose"][..., :2], windows["node_velocity"]

    def mean(nodes: Array, weights: Array, quicker: Array | float = 0.0) -> Array:
        place, velocity = (_carried(values, nodes) for values in (places, velocities))
        at = plate.at(_moments_ns(windows, nodes)).quickened(quicker)
        load = driving(at, place, velocity) * (1.0, 1.0, -1.0)
        return (load.reshape(len(windows), len(nodes), 3) * weights[..., None]).sum(axis=1)

    return mean(FINE_NODES, windows["weight"]) - mean(NODES, WEIGHTS, uneven)


def _carried(values: Array, nodes: Array) -> Array:
    """Returns values (n, 3, 2) at the windows' nodes, extrapolated by a straight line to other nodes (k,): (n k, 2)."""
    slope = (values[:, -1] - values[:, 0]) / (NODES[-1] - NODES[0])
    return (values.mean(axis=1)[:, None] + slope[:, None] * nodes[None, :, None]).reshape(-1, 2)


def _of_runs(values: tuple[Array, Array], runs: Times) -> tuple[Array, Array]:
    return values[0][runs], values[1][runs]


def _resting_yaw(track: RunTrack) -> float:
    frames = track.frames(track.level_ns, track.slip_ns)
    return float(np.median(track.pose[frames, 2])) if frames.stop > frames.start else track.sample.start_yaw_rad

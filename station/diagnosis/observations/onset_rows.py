"""Builds the onset channel from a session's samples."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from shared.messages import Sample
from station.diagnosis import thresholds
from station.diagnosis.observations.channel import Channel, rows_of
from station.diagnosis.observations.memory import memory_of
from station.diagnosis.observations.moments import Moments
from station.diagnosis.observations.onsets import Onsets
from station.diagnosis.observations.plate import PlateMotion
from station.diagnosis.observations.released import released
from station.diagnosis.observations.starts import leans, starts
from station.diagnosis.observations.tracks import RunTrack
from station.physics.contact import Array
from station.physics.covariates import covariates_of
from station.signals.flags import NO_TILT, UNRESOLVED

if TYPE_CHECKING:
    from station.diagnosis.observations.build import Recorded

LEAST_SIGMA_RAD = 2e-4
"""The smallest standard error of an onset's angle: an attitude is not trusted to less."""


def onset_channel(recorded: Recorded) -> Sequence[Channel]:
    """Returns the onsets of all runs that slid, and the limits of those that did not."""
    chosen = [(run, track) for run, track in enumerate(recorded.tracks) if _usable(track, recorded)]
    if not chosen:
        return []
    tracks = [track for _, track in chosen]
    time_ns = np.array([_moment_ns(track, recorded.plate) for track in tracks], dtype=np.int64)
    pose = starts(tracks)
    dwell_by_tilt, plate = recorded.dwell_by_tilt.of([run for run, _ in chosen]), recorded.plate
    moments = Moments(
        time_ns=time_ns,
        run=np.array([run for run, _ in chosen], dtype=np.int64),
        facts=recorded.facts,
        attitude=lambda delay_s: plate.at(time_ns, delay_s=delay_s),
        place_m=pose[:, :2],
        yaw_rad=pose[:, 2],
        border_m=recorded.setting.free_m(pose),
        rest_s=dwell_by_tilt.typical(),
        rest_s_at=dwell_by_tilt.at,
        at_rest=True,
        steeper_rad=_steeper(tracks, recorded.slipping),
    )
    contact, runs = moments.reported, [run for run, _ in chosen]
    tilt = contact.tilt_rad
    sigma = np.hypot([sigma_of(track.sample) for track in tracks], recorded.plate.sigma_rad(time_ns))
    sigma /= np.maximum(np.sin(tilt) * np.cos(tilt), 1e-3)
    rows = rows_of(
        {
            "run": moments.run,
            "from_ns": np.array([track.tilt_ns for track in tracks]),
            "to_ns": np.array([max(track.sample.detect_ns, track.slip_ns, track.tilt_ns) for track in tracks]),
            "sigma": sigma,
            "limit": np.array([track.sample.censored for track in tracks]),
        },
        {
            **covariates_of(contact),
            # The rate at the very moment is read with the onset: where a run held it is that of a plate at rest.
            "tilt_rate": np.array([abs(track.sample.tilt_rate_rad_s) for track in tracks]),
            **memory_of(runs, contact.down_rad, recorded.tracks),
        },
    )
    return [Onsets(rows, moments, released(recorded, runs), recorded.slow_slides)]


def _usable(track: RunTrack, recorded: Recorded) -> bool:
    """Returns true if the plate was tilted until the block slid or held, and the block free of the foam."""
    if NO_TILT in track.sample.flags:
        return False
    time_ns = _moment_ns(track, recorded.plate)
    steep = bool(recorded.plate.at(np.array([time_ns])).tilt_rad[0] > thresholds.LEAST_TILT_RAD)
    return steep and not leans(track, recorded.setting)


def _steeper(tracks: Sequence[RunTrack], plate: PlateMotion) -> Array:
    """Gives the tilts (n,) that a plate at rest would have needed beyond the reported ones, if re-estimated; else 0."""
    at = plate.at(np.array([track.slip_ns or track.tilt_ns for track in tracks], dtype=np.int64)).tilt_rad
    read = np.array([track.slip_tilt_rad for track in tracks])
    return np.where(read > 0, read - at, 0.0)


def _moment_ns(track: RunTrack, plate: PlateMotion) -> int:
    """Returns the time of the onset, or that of the steepest tilt that the block bore in a run without a slide."""
    if not track.sample.censored:
        return track.slip_ns
    times = np.linspace(track.tilt_ns, track.held_until_ns, 200).astype(np.int64)
    return int(times[int(np.argmax(plate.at(times).tilt_rad))])


def sigma_of(sample: Sample) -> float:
    """Returns the standard error of the onset's angle, rad.

    An onset that could not be fitted lies somewhere within its step.
    """
    width = abs(sample.step_to_rad - sample.step_from_rad)
    if UNRESOLVED in sample.flags or not sample.onset_sigma_rad > 0:
        return max(width / math.sqrt(12), LEAST_SIGMA_RAD)
    return max(sample.onset_sigma_rad, LEAST_SIGMA_RAD)

"""Builds the channels of the other angle sensors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from station.diagnosis.observations.channel import Channel, rows_of
from station.diagnosis.observations.marks import SENSOR_POINTS, Sensor
from station.diagnosis.observations.moments import Moments
from station.diagnosis.observations.plate import Times
from station.diagnosis.observations.tracks import RunTrack
from station.physics.contact import Array
from station.physics.model import Model

if TYPE_CHECKING:
    from station.diagnosis.observations.build import Recorded

STRETCHES = 6
LEAST_READINGS = 3
LEAST_TILT_RAD = 0.07
LEAST_SIGMA_RAD = 2e-5
PLAY_RAD = 0.03
"""The largest angle by which a plate with play may have to turn back before it follows."""


def sensor_channel(recorded: Recorded) -> Sequence[Channel]:
    """Returns one channel for each sensor, in stretches of each run, the tilt's return included."""
    found = [_one(recorded, source) for source in sorted(recorded.signals.angles)]
    return [channel for channel in found if channel is not None]


def _one(recorded: Recorded, source: str) -> Sensor | None:
    track = recorded.signals.angles[source]
    track = track.select(np.isfinite(track.angle_rad))
    if len(track) < LEAST_READINGS:
        return None
    plate = recorded.plate
    reported = plate.at(track.time_ns)
    # Near level a noisy sensor reads too steep, as the angle between two vectors is never negative.
    steep = reported.tilt_rad > LEAST_TILT_RAD
    track, tilt_rad, rising = track.select(steep), reported.tilt_rad[steep], reported.rising[steep]
    difference_rad = track.angle_rad - tilt_rad
    stretches = [
        (index, chosen)
        for index, run in enumerate(recorded.tracks)
        for chosen in _stretches(run, track.time_ns, tilt_rad, rising)
    ]
    if not stretches:
        return None
    run = np.array([index for index, _ in stretches], dtype=np.int64)
    size = np.array([len(chosen) for _, chosen in stretches])
    difference = np.array([difference_rad[chosen].mean() for _, chosen in stretches])
    single = float(np.median([np.std(difference_rad[chosen], ddof=1) for _, chosen in stretches]))
    sigma = np.maximum(single / np.sqrt(size), LEAST_SIGMA_RAD)
    time_ns = np.concatenate([track.time_ns[_spread(chosen)] for _, chosen in stretches])
    moments = Moments(
        time_ns=time_ns,
        run=np.repeat(run, SENSOR_POINTS),
        facts=recorded.facts,
        attitude=lambda delay_s: plate.at(time_ns, delay_s=delay_s),
        delay_s=Model.arm_delay_s,
    )
    middle = slice(SENSOR_POINTS // 2, None, SENSOR_POINTS)
    covariates = {
        "tilt": moments.reported.tilt_rad[middle],
        "direction": moments.reported.down_rad[middle],
        "rising": moments.reported.rising[middle],
        "run": recorded.facts.number[run],
    }
    columns = {
        "run": run,
        "from_ns": np.array([track.time_ns[chosen[0]] for _, chosen in stretches]),
        "to_ns": np.array([track.time_ns[chosen[-1]] for _, chosen in stretches]),
        "sigma": sigma,
    }
    return Sensor(rows_of(columns, covariates), source, difference, moments)


def _stretches(run: RunTrack, time_ns: Times, tilt_rad: Array, rising: Array) -> Iterator[Times]:
    """Yields the readings' indices of each stretch of a run; within none does the tilt change its direction.

    Just after the tilt has turned back a plate with play does not follow yet: those readings are left out.
    """
    first, last = np.searchsorted(time_ns, (run.tilt_ns, run.end_ns))
    if last - first < LEAST_READINGS:
        return
    numbers = np.arange(first, last)
    top = float(tilt_rad[first:last].max())
    edges = np.linspace(run.tilt_ns, run.end_ns, STRETCHES + 1).astype(np.int64)
    stretch = np.searchsorted(edges, time_ns[first:last], side="right")
    for number in np.unique(stretch):
        for way in (1.0, -1.0):
            free = (way > 0) | (tilt_rad[first:last] < top - PLAY_RAD)
            chosen = numbers[(stretch == number) & (rising[first:last] == way) & free]
            if len(chosen) >= LEAST_READINGS:
                yield chosen


def _spread(chosen: Times) -> Times:
    """Returns SENSOR_POINTS of the readings' indices, each from the middle of an equal share of them.

    Their mean is that of all readings: points that include both ends weigh these twice.
    """
    share = (np.arange(SENSOR_POINTS) + 0.5) / SENSOR_POINTS
    return chosen[(share * len(chosen)).astype(np.int64)]

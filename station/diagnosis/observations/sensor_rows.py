"""Builds the channels of the other angle sensors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from station.diagnosis.observations.channel import Channel, Rows, rows_of
from station.diagnosis.observations.moments import Moments
from station.diagnosis.observations.plate import Attitude, Times
from station.diagnosis.observations.sensor import Sensor
from station.diagnosis.observations.sensor_readings import Directions, Stretches, Tilts
from station.diagnosis.observations.tracks import RunTrack
from station.physics.contact import Array
from station.physics.model import Model
from station.signals.tracks import AngleTrack

if TYPE_CHECKING:
    from station.diagnosis.observations.build import Recorded

STRETCHES = 6
LEAST_READINGS = 3
POINTS = 15
"""The most moments of a stretch at which models are asked for the plate; fewer would not follow how it is set in motion
(`pytest tests/unit/diagnosis/test_sensor_rows.py` compares their mean with that of up to 113 readings)."""

LEAST_TILT_RAD = 0.07
LEAST_SIGMA_RAD = 2e-5
PLAY_RAD = 0.03
"""The largest angle by which a plate with play may have to turn back before it follows."""


@dataclass(frozen=True, eq=False)
class Stretch:
    """The readings of a run, by its index, that count as one row, by their indices."""

    run: int
    chosen: Times


def sensor_channels(recorded: Recorded) -> Sequence[Channel]:
    """Returns the channels of each sensor, in stretches of each run, the tilt's return included."""
    sources = sorted(recorded.signals.angles) if recorded.tracks else ()
    return [channel for source in sources for channel in _of(recorded, source)]


def _of(recorded: Recorded, source: str) -> Sequence[Channel]:
    track = recorded.signals.angles[source]
    track = track.select(np.isfinite(track.angle_rad))
    # Near level a noisy sensor reads too steep, as the angle between two vectors is never negative.
    track = track.select(recorded.plate.gravity_at(track.time_ns)[:, 2] > -np.cos(LEAST_TILT_RAD))
    reported = recorded.plate.at(track.time_ns)
    stretches = [
        Stretch(index, chosen)
        for index, run in enumerate(recorded.tracks)
        for chosen in _stretches(run, track.time_ns, reported)
    ]
    if not stretches:
        return ()
    directed = bool(np.isfinite(track.gravity).all() and track.gravity.any(axis=1).all())
    build = _directed if directed else _undirected
    return build(recorded, source, track, reported=reported, stretches=stretches)


def _directed(
    recorded: Recorded, source: str, track: AngleTrack, *, reported: Attitude, stretches: Sequence[Stretch]
) -> Sequence[Channel]:
    """Returns what a sensor that knows gravity's direction reads along the slope and across it."""
    gravity = track.gravity / np.linalg.norm(track.gravity, axis=1, keepdims=True)
    asked = _asked(recorded, track.time_ns, stretches)
    rows = _rows(recorded, track.time_ns, stretches, apart=(gravity - reported.gravity)[:, :2], asked=asked)
    read = Directions(
        _means(gravity, stretches),
        _means(reported.gravity, stretches),
        stretches=asked,
        sigma=rows.sigma,
        mount_rad=recorded.facts.mount_rad[rows.run],
    )
    title = f"the angle sensor {source}"
    return (
        Sensor(rows, source, title, read.along, level_tells=True),
        Sensor(rows, f"{source}:across", f"{title}, across the slope,", read.across, level_tells=False),
    )


def _undirected(
    recorded: Recorded, source: str, track: AngleTrack, *, reported: Attitude, stretches: Sequence[Stretch]
) -> Sequence[Channel]:
    apart_rad = track.angle_rad - reported.tilt_rad
    asked = _asked(recorded, track.time_ns, stretches)
    rows = _rows(recorded, track.time_ns, stretches, apart=apart_rad[:, None], asked=asked)
    mount_rad = recorded.facts.mount_rad[rows.run]
    read = Tilts(_means(apart_rad, stretches), stretches=asked, sigma=rows.sigma, mount_rad=mount_rad)
    return (Sensor(rows, source, f"the angle sensor {source}", read.along, level_tells=False),)


def _stretches(run: RunTrack, time_ns: Times, reported: Attitude) -> Iterator[Times]:
    """Yields the readings' indices of each stretch of a run; within none does the tilt change its direction.

    Just after the tilt has turned back a plate with play does not follow yet: those readings are left out.
    """
    first, last = np.searchsorted(time_ns, (run.tilt_ns, run.end_ns))
    if last - first < LEAST_READINGS:
        return
    numbers = np.arange(first, last)
    tilt_rad, rising = reported.tilt_rad[first:last], reported.rising[first:last]
    edges = np.linspace(run.tilt_ns, run.end_ns, STRETCHES + 1).astype(np.int64)
    stretch = np.searchsorted(edges, time_ns[first:last], side="right")
    for number in np.unique(stretch):
        for way in (1.0, -1.0):
            free = (way > 0) | (tilt_rad < float(tilt_rad.max()) - PLAY_RAD)
            chosen = numbers[(stretch == number) & (rising == way) & free]
            if len(chosen) >= LEAST_READINGS:
                yield chosen


def _asked(recorded: Recorded, time_ns: Times, stretches: Sequence[Stretch]) -> Stretches:
    """Returns the moments of the stretches among readings at `time_ns` (n,), ns."""
    seen_ns = [_spread(time_ns[stretch.chosen]) for stretch in stretches]
    every_ns, count = np.concatenate(seen_ns), np.array([len(seen) for seen in seen_ns])
    moments = Moments(
        time_ns=every_ns,
        run=np.repeat([stretch.run for stretch in stretches], count),
        facts=recorded.facts,
        attitude=lambda delay_s: recorded.plate.at(every_ns, delay_s=delay_s),
        delay_s=Model.arm_delay_s,
    )
    return Stretches(moments, count)


def _spread(time_ns: Times) -> Times:
    """Returns moments (m,), POINTS at most, whose mean stands for that of readings at `time_ns` (n,), ns.

    Each is in the middle of an equal share of them: moments that include both ends would weigh these twice.
    """
    count = min(len(time_ns), POINTS)
    places = (np.arange(count) + 0.5) / count * len(time_ns) - 0.5
    return np.round(time_ns[0] + np.interp(places, np.arange(len(time_ns)), time_ns - time_ns[0])).astype(np.int64)


def _means(values: Array, stretches: Sequence[Stretch]) -> Array:
    """Returns the means (s, ...) of values (n, ...) in each stretch."""
    return np.array([values[stretch.chosen].mean(axis=0) for stretch in stretches])


def _rows(recorded: Recorded, time_ns: Times, stretches: Sequence[Stretch], *, apart: Array, asked: Stretches) -> Rows:
    """Returns the rows of stretches (s,); `apart` (n, axes) are single readings less the arm's, rad."""
    run, middle = np.array([stretch.run for stretch in stretches]), asked.middle
    columns = {
        "run": run,
        "from_ns": np.array([time_ns[stretch.chosen[0]] for stretch in stretches]),
        "to_ns": np.array([time_ns[stretch.chosen[-1]] for stretch in stretches]),
        "sigma": _noise(apart, stretches),
    }
    covariates = {
        "tilt": middle.tilt_rad,
        "direction": middle.down_rad,
        "rising": middle.rising,
        "run": recorded.facts.number[run],
    }
    return rows_of(columns, covariates)


def _noise(apart: Array, stretches: Sequence[Stretch]) -> Array:
    """Returns the standard error (s,), rad, of stretches' means.

    A reading's noise is told by how readings differ from the line between their neighbours (Gasser, Sroka and
    Jennen-Steinmetz 1986, Biometrika 73, 625): a late clock lets them wander within a stretch by many times as much.
    """
    bends = [np.square(np.diff(apart[stretch.chosen], n=2, axis=0)).mean() / 6.0 for stretch in stretches]
    size = np.array([len(stretch.chosen) for stretch in stretches])
    return np.maximum(np.sqrt(float(np.median(bends)) / size), LEAST_SIGMA_RAD)

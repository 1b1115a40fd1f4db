"""Builds the channel of the other angle sensors."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from station.gap.evidence.channel import Channel, rows_of
from station.gap.evidence.marks import Sensor
from station.gap.evidence.moments import Moments

if TYPE_CHECKING:
    from station.gap.evidence.build import Recorded

STRETCHES = 6
LEAST_READINGS = 3
LEAST_TILT_RAD = 0.07


def sensor_channel(recorded: Recorded) -> Sequence[Channel]:
    """One channel for each sensor, in stretches of each run, the tilt's return included."""
    found = [_one(recorded, source) for source in sorted(recorded.signals.angles)]
    return [channel for channel in found if channel is not None]


def _one(recorded: Recorded, source: str) -> Sensor | None:
    track = recorded.signals.angles[source]
    track = track.select(np.isfinite(track.angle_rad))
    if len(track) < LEAST_READINGS:
        return None
    rows: list[tuple[int, int, int, float, float]] = []
    reported = recorded.plate.at(track.time_ns)
    # Near level a noisy sensor reads too steep, as no angle between two vectors is negative.
    steep = reported.tilt_rad > LEAST_TILT_RAD
    track, tilt_rad = track.select(steep), reported.tilt_rad[steep]
    for place, run in enumerate(recorded.tracks):
        edges = np.linspace(run.tilt_ns, run.end_ns, STRETCHES + 1).astype(np.int64)
        for begin, end in itertools.pairwise(edges.tolist()):
            first, last = np.searchsorted(track.time_ns, (begin, end))
            if last - first < LEAST_READINGS:
                continue
            difference = track.angle_rad[first:last] - tilt_rad[first:last]
            spread = float(np.std(difference, ddof=1)) / np.sqrt(last - first)
            rows.append((place, begin, end, float(difference.mean()), max(spread, 2e-5)))
    if not rows:
        return None
    run, from_ns, to_ns, difference, sigma = (np.array(column) for column in zip(*rows, strict=True))
    time_ns = (from_ns + to_ns) // 2
    moments = Moments(
        time_ns=time_ns,
        run=run,
        facts=recorded.facts,
        attitude=lambda delay_s: recorded.plate.at(time_ns, delay_s=delay_s),
        place_m=np.zeros((len(run), 2)),
        yaw_rad=np.zeros(len(run)),
        velocity_m_s=np.zeros((len(run), 2)),
        moving=np.zeros(len(run), dtype=np.bool_),
        slip_ns=time_ns,
        border_m=np.full(len(run), np.inf),
    )
    covariates = {
        "tilt": moments.reported.tilt_rad,
        "direction": moments.reported.down_rad,
        "rising": moments.reported.rising,
        "run": recorded.facts.number[run],
    }
    columns = {"run": run, "from_ns": from_ns, "to_ns": to_ns, "sigma": sigma}
    return Sensor(rows_of(columns, covariates), source, difference, moments)

"""The columns of a recording's tables, made of its samples and signals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shared.messages import Sample
from station.recording.tables import LENGTHS
from station.signals.session import Signals
from station.signals.tracks import Integers, Times
from station.simulators.recorded_runs import poses_of

Columns = dict[str, NDArray[Any]]

NO_RUN = -1
_FLAG_SEPARATOR = "|"
_XY = tuple(enumerate("xy"))


def samples(every: Sequence[Sample]) -> Columns:
    """Returns a row for each run, with the columns that `station samples --csv` writes.

    What is written can be read again.
    """
    found: Columns = {}
    for spec in fields(Sample):
        values = [getattr(sample, spec.name) for sample in every]
        if spec.name in LENGTHS:
            found |= _numbered(spec.name, values)
        elif spec.name == "flags":
            found["flags"] = np.array([_FLAG_SEPARATOR.join(flags) for flags in values], dtype=np.str_)
        else:
            found[spec.name] = np.array(values, dtype=type(spec.default))
    return found


def _numbered(name: str, values: Sequence[Sequence[float]]) -> Columns:
    """Returns a column for each number of a vector; nan where a run has none."""
    table = np.full((len(values), LENGTHS[name]), np.nan)
    for row, vector in zip(table, values, strict=True):
        row[: len(vector)] = vector
    return {f"{name}_{index}": table[:, index] for index in range(LENGTHS[name])}


def corners(signals: Signals) -> Columns:
    """Returns a row for each frame of the block's mark."""
    track = signals.corners
    columns = {f"{axis}{corner}_px": track.corner_px[:, corner, index] for corner in range(4) for index, axis in _XY}
    return {
        "time_ns": track.time_ns,
        "run": run_at(signals, track.time_ns),
        **columns,
        **{f"dt{corner}_ns": track.corner_dt_ns[:, corner] for corner in range(4)},
        "sigma_px": track.sigma_px,
        "found": track.found,
        "tipped": track.tipped,
        "seq": track.seq,
        "boot_id": track.boot_id,
    }


def poses(signals: Signals) -> Columns:
    """Returns a row for each frame in which the block was found."""
    seen = poses_of(signals)
    x_m, y_m, yaw_rad = seen.pose.T
    own = {"x_m": x_m, "y_m": y_m, "yaw_rad": yaw_rad, "flat": seen.flat}
    return {"time_ns": seen.time_ns, "run": run_at(signals, seen.time_ns), **own}


def attitude(signals: Signals) -> Columns:
    """Returns a row for each attitude of the plate."""
    track = signals.attitude
    qw, qx, qy, qz = track.quaternion.T
    wx, wy, wz = track.rate_rad_s.T
    px, py, pz = track.pivot_m.T
    return {
        "time_ns": track.time_ns,
        "run": run_at(signals, track.time_ns),
        "tilt_rad": track.tilt_rad,
        **{"qw": qw, "qx": qx, "qy": qy, "qz": qz},
        **{"wx_rad_s": wx, "wy_rad_s": wy, "wz_rad_s": wz},
        **{"pivot_x_m": px, "pivot_y_m": py, "pivot_z_m": pz},
    }


def of_track(track: Any) -> Columns:
    """Returns the columns of a track whose fields are its columns."""
    return {spec.name: getattr(track, spec.name) for spec in fields(track)}


def run_at(signals: Signals, time_ns: Times) -> Integers:
    """Returns the numbers (n,) of the runs that go on at the times `time_ns` (n,), ns, which ascend.

    It is `NO_RUN` where none does.

    A run goes on from its first event, and before its last.
    """
    found = np.full(len(time_ns), NO_RUN, dtype=np.int64)
    for run in signals.runs:
        first, last = np.searchsorted(time_ns, signals.span_ns(run))
        found[first:last] = run
    return found

"""The begin of a run's tilt and of its slide, which no column says: from the attitude and the block's path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from shared.geometry import Array
from station.recording.importers import Traced
from station.recording.importers.tracks.plate import downhill_of, tilt_of
from station.recording.importers.tracks.runs import Times

TURNS_RAD = 0.02
"""A plate that turns by less within a run does not tilt until the block slides; an onset at less tells nothing either
(`station.diagnosis.thresholds.LEAST_TILT_RAD`)."""

BEGINS_RAD = 2e-3
"""A tilt has begun when it has grown by this much: ten times the noise of a usual attitude."""

MOVED_M = 2e-3
"""A block has slid when it is this far from where it lay: about the 10 px of the paper's rule."""

FITTED_NS = 3_000_000_000
"""The stretch of path before the detection that is fitted, as on the rig."""


@dataclass(frozen=True, kw_only=True)
class Slip:
    """The begin of a run's tilt and, 0 if the block held, its slide and the slide's detection, ns; the onset's tilt, rad.

    `place` is the frame of the onset.
    """

    tilt_ns: int
    slip_ns: int
    detect_ns: int
    angle_rad: float
    sigma_rad: float
    place: int
    resolved: bool


def tilts(quaternion: Array) -> bool:
    """True if a run's plate (k, 4) is tilted during the run."""
    return bool(np.ptp(tilt_of(quaternion)) > TURNS_RAD)


def slip_of(time_ns: Times, quaternion: Array, place_m: Array, found: Array, *, traced: Traced | None) -> Slip:
    """The slip of a run whose plate tilts: stamps (k,), attitudes (k, 4), places (k, 2) where the block was `found`."""
    tilt = tilt_of(quaternion)
    begin = max(int(np.argmax(np.abs(tilt - tilt[0]) > BEGINS_RAD)) - 1, 0)
    seen = np.flatnonzero(found)
    rest = np.median(place_m[seen[: max(int(np.searchsorted(seen, begin)), 1)]], axis=0)
    away = np.hypot(*(place_m[seen] - rest).T) > MOVED_M
    slid = np.flatnonzero(away)
    tilt_ns = int(time_ns[begin])
    if not len(slid):
        steepest = int(np.argmax(tilt))
        return Slip(
            tilt_ns=tilt_ns, slip_ns=0, detect_ns=0, angle_rad=float(tilt[steepest]), sigma_rad=0.0, place=steepest,
            resolved=True,
        )  # fmt: skip
    detected = int(seen[slid[0]])
    fit = None if traced is None else _fitted(time_ns, quaternion, place_m, seen[: slid[0] + 1], rest, begin, traced)
    if fit is None:
        return Slip(
            tilt_ns=tilt_ns, slip_ns=int(time_ns[detected]), detect_ns=int(time_ns[detected]),
            angle_rad=float(tilt[detected]), sigma_rad=float(np.ptp(tilt[begin : detected + 1])) / np.sqrt(12.0),
            place=detected, resolved=False,
        )  # fmt: skip
    return Slip(
        tilt_ns=tilt_ns,
        slip_ns=int(fit.slip_ns),
        detect_ns=int(time_ns[detected]),
        angle_rad=float(fit.angle_rad),
        sigma_rad=float(fit.angle_sigma_rad),
        place=int(np.clip(np.searchsorted(time_ns, fit.slip_ns), 0, len(time_ns) - 1)),
        resolved=True,
    )


def _fitted(
    time_ns: Times, quaternion: Array, place_m: Array, frames: Array, rest: Array, begin: int, traced: Traced
) -> Any:
    """The onset fitted to the path up to the last of `frames`; None if it cannot be."""
    detected = int(frames[-1])
    first = max(begin, int(np.searchsorted(time_ns, time_ns[detected] - FITTED_NS)))
    own, down = frames[frames >= first], downhill_of(quaternion)[detected]
    slide = place_m[detected] - rest
    way = slide / np.linalg.norm(slide)
    before = place_m[frames[frames < max(begin, 3)]] if begin > 3 else place_m[own[:3]]
    return traced(
        time_ns[own],
        (place_m[own] - rest) @ way,
        tilt_ns=time_ns[first : detected + 2],
        tilt_rad=tilt_of(quaternion[first : detected + 2]),
        sigma_m=max(float(np.std(before @ way)), 1e-6),
        along=max(0.2, float(way @ down)),
        ahead_m=float(rest @ down),
    )

"""Re-estimates the onsets from the slides' paths, if a session's slides are not plain.

The rig's estimate assumes a plain slide until that run's data refute it, and then reads the kinetic friction instead of
the static. For one run that is the better choice; over a session it hides more than half of a kinetic drop of four per
cent, and whatever else distinguishes slide from onset. What all slides of a session share (`breakaway`) determines when
each began.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.observations.breakaway import Breakaways, Law
from station.diagnosis.observations.breakaway_law import session_law
from station.diagnosis.observations.early import Early, early
from station.diagnosis.observations.first_look import Look, first_look
from station.diagnosis.observations.plate import PlateMotion
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.starts import leans
from station.diagnosis.observations.tracks import RunTrack
from station.physics.contact import Array

READ = 61
"""The number of moments over which a slip's expectation is taken."""

UNSEEN_S, UNSEEN = 0.012, 0.5
"""The attitude's readings do not resolve how a motion begins and ends: of the change by its acceleration within
UNSEEN_S of a slip, the share UNSEEN may or may not act at the slip."""


@dataclass(frozen=True, eq=False)
class Reread:
    """A session's runs; `places` are those with re-estimated slips, `paths` their breakaways, `law` what they share."""

    tracks: tuple[RunTrack, ...]
    places: tuple[int, ...] = ()
    paths: Breakaways | None = None
    law: Law = Law()  # noqa: RUF009 (it is frozen)


def reread(tracks: Sequence[RunTrack], plate: PlateMotion, setting: Setting) -> Reread:
    """The runs with their slips re-estimated, if the session's slides are not plain; else unchanged.

    A block that lay against the foam was held or pushed by it: its slide says nothing about the others'.
    """
    free = {place: track for place, track in enumerate(tracks) if not leans(track, setting)}
    found = {place: seen for place, track in free.items() if (seen := _seen(track, plate, setting)) is not None}
    if len(found) < thresholds.LEAST_KNOWN or _plain([look for _, look in found.values()]):
        return Reread(tuple(tracks))
    paths = Breakaways.of(list(found.values()))
    law = session_law(paths, drag_per_s=float(np.median([look.drag_per_s for _, look in found.values()])))
    slips = dict(zip(found, _slips(paths, law), strict=True))
    moved = (_moved(track, slips[place]) if place in slips else track for place, track in enumerate(tracks))
    return Reread(tuple(moved), tuple(found), paths, law)


def _seen(track: RunTrack, plate: PlateMotion, setting: Setting) -> tuple[Early, Look] | None:
    run = early(track, plate, setting)
    look = None if run is None else first_look(run)
    return None if run is None or look is None else (run, look)


def _plain(looks: Sequence[Look]) -> bool:
    most = thresholds.PLAIN_SIGMAS
    pulls = np.clip(np.array([(look.lacking, look.slowing) for look in looks]), -most, most)
    lacking, slowing = pulls.mean(axis=0) * np.sqrt(len(pulls)) / np.maximum(pulls.std(axis=0), 1.0)
    return bool(lacking < most and abs(slowing) < most)


@dataclass(frozen=True, slots=True)
class _Slip:
    """A slip's time from the rig's, s, the tilt at which a plate at rest pulls as much, and its standard error."""

    time_s: float
    tilt_rad: float
    tilt_sigma_rad: float


def _moved(track: RunTrack, slip: _Slip) -> RunTrack:
    return replace(
        track,
        slip_ns=track.slip_ns + round(slip.time_s * 1e9),
        slip_tilt_rad=slip.tilt_rad,
        surely_ns=track.slip_ns,
        sample=replace(track.sample, onset_sigma_rad=slip.tilt_sigma_rad),
    )


def _slips(paths: Breakaways, law: Law) -> list[_Slip]:
    """The expected time and tilt of each run's slip, and the tilt's standard error."""
    paths = paths.nearer(law, READ).nearer(law, READ)
    read = zip(paths.runs, paths.chances(law), paths.tried_s, strict=True)
    return [_slip(run, chance, tried) for run, chance, tried in read]


def _slip(run: Early, chance: Array, tried_s: Array) -> _Slip:
    tilt = np.interp(tried_s, run.grid_s, np.maximum.accumulate(run.tilt_rad))
    time_s, mean = float(chance @ tried_s), float(chance @ tilt)
    near = np.abs(run.grid_s - time_s) < UNSEEN_S
    unseen = UNSEEN * float(np.ptp((run.tilt_rad - run.plate_rad)[near])) if near.any() else 0.0
    return _Slip(time_s, mean, max(math.sqrt(float(chance @ (tilt - mean) ** 2) + unseen**2), 1e-5))

"""Re-estimates the onsets from the slides' paths, if a session's slides are not plain.

The rig's estimate assumes a plain slide until that run's data refute it, and then reads the kinetic friction instead of
the static. For one run that is the better choice; over a session it hides more than half of a kinetic drop of four per
cent, and whatever else distinguishes slide from onset. What all slides of a session share (`breakaway`) determines when
each began, and about which point the plate turned meanwhile: a plate that pushes the blocks as it is set in motion
makes slides that begin at such pushes, and look like a rise of friction.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.observations.breakaway import Breakaways, Law
from station.diagnosis.observations.breakaway_arm import PLAIN, likeliest_arm
from station.diagnosis.observations.breakaway_law import session_law
from station.diagnosis.observations.early import Early, early
from station.diagnosis.observations.first_look import Look, first_look
from station.diagnosis.observations.plate import PlateMotion
from station.diagnosis.observations.rig_offsets import UNKNOWN_OFFSETS, RigOffsets
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.starts import leans
from station.diagnosis.observations.tracks import RunTrack
from station.physics.contact import Array

READ = 61
"""The number of moments over which a slip's expectation is taken."""

UNSEEN_S, UNSEEN = 0.012, 0.5
"""The attitude's readings do not resolve how a motion begins and ends: of the change by its acceleration within
UNSEEN_S of a slip, the share UNSEEN may or may not act at the slip."""


Seen = tuple[Early, Look]


@dataclass(frozen=True, eq=False)
class Slipping:
    """A run's first path on a plate with the configured pivot, and when it slipped: chances (k,) of moments (k,).

    These are in s from `origin_ns`. `time_s` and `tilt_rad` are the expected moment and tilt at which a plate at rest
    would have released the block, with the tilt's standard error.
    """

    run: Early
    origin_ns: int
    chance: Array
    tried_s: Array
    time_s: float
    tilt_rad: float
    tilt_sigma_rad: float


@dataclass(frozen=True, eq=False)
class Reread:
    """A session's runs; `slips` are those that were re-estimated, by their indices, and `paths` their breakaways.

    `law` is what they share, and `paths` have the loads of the plate that they show: `arm_m` (3,), m in P, is from the
    pivot about which it turned to the configured one.
    """

    tracks: tuple[RunTrack, ...]
    slips: Mapping[int, Slipping] = field(default_factory=dict[int, Slipping])
    paths: Breakaways | None = None
    law: Law = Law()  # noqa: RUF009 (it is frozen)
    arm_m: Array = field(default_factory=lambda: np.zeros(3))

    @property
    def indices(self) -> tuple[int, ...]:
        """The runs whose slips were re-estimated, in the order of `paths`."""
        return tuple(self.slips)


def reread(
    tracks: Sequence[RunTrack], plate: PlateMotion, setting: Setting, rig_offsets: RigOffsets = UNKNOWN_OFFSETS
) -> Reread:
    """Returns the runs with their slips re-estimated, if the slides are not plain or by the `rig_offsets`.

    Otherwise they are unchanged.

    A block that lay against the foam was held or pushed by it: its slide says nothing about the others'.
    """
    free = {index: track for index, track in enumerate(tracks) if not leans(track, setting)}
    found = {index: seen for index, track in free.items() if (seen := _seen(track, plate, setting)) is not None}
    if len(found) < thresholds.LEAST_KNOWN:
        return Reread(tuple(tracks), arm_m=np.zeros(3) if rig_offsets.arm_m is None else rig_offsets.arm_m)
    plain, paths = _plain([look for _, look in found.values()]), Breakaways.of(list(found.values()))
    law = PLAIN if plain else _law(paths, found)
    arm_m = likeliest_arm(paths, law) if rig_offsets.arm_m is None else rig_offsets.arm_m
    if plain and not arm_m.any() and not rig_offsets.late_s:
        return Reread(tuple(tracks))
    if arm_m.any():
        found = {index: seen for index, (run, _) in found.items() if (seen := _looked(run.turning_about(arm_m)))}
        paths = Breakaways.of(list(found.values()))
        law = _law(paths, found)
    slips = _slips(paths, law, {index: free[index].slip_ns for index in found})
    moved = (_moved(track, slips[index]) if index in slips else track for index, track in enumerate(tracks))
    return Reread(tuple(moved), slips, paths, law, arm_m)


def _law(paths: Breakaways, found: Mapping[int, Seen]) -> Law:
    return session_law(paths, drag_per_s=float(np.median([look.drag_per_s for _, look in found.values()])))


def _seen(track: RunTrack, plate: PlateMotion, setting: Setting) -> Seen | None:
    run = early(track, plate, setting)
    return None if run is None else _looked(run)


def _looked(run: Early) -> Seen | None:
    look = first_look(run)
    return None if look is None else (run, look)


def _plain(looks: Sequence[Look]) -> bool:
    most = thresholds.PLAIN_SIGMAS
    pulls = np.clip(np.array([(look.lacking, look.slowing) for look in looks]), -most, most)
    lacking, slowing = pulls.mean(axis=0) * np.sqrt(len(pulls)) / np.maximum(pulls.std(axis=0), 1.0)
    return bool(lacking < most and abs(slowing) < most)


def _moved(track: RunTrack, slip: Slipping) -> RunTrack:
    return replace(
        track,
        slip_ns=track.slip_ns + round(slip.time_s * 1e9),
        slip_tilt_rad=slip.tilt_rad,
        surely_ns=track.slip_ns,
        sample=replace(track.sample, onset_sigma_rad=slip.tilt_sigma_rad),
    )


def _slips(paths: Breakaways, law: Law, origin_ns: Mapping[int, int]) -> dict[int, Slipping]:
    """Returns each run's slip, by the indices of `origin_ns`, from which its times are counted."""
    paths = paths.nearer(law, READ).nearer(law, READ)
    read = zip(origin_ns.items(), paths.runs, paths.chances(law), paths.tried_s, strict=True)
    return {index: _slip(run, origin, chance, tried) for (index, origin), run, chance, tried in read}


def _slip(run: Early, origin_ns: int, chance: Array, tried_s: Array) -> Slipping:
    """Returns a run's slip.

    The moments are those that its own loads make likely, and the tilt is that of the configured pivot.
    """
    configured = run.turning_about(np.zeros(3))
    time_s = float(chance @ tried_s)
    near = np.abs(run.grid_s - time_s) < UNSEEN_S
    unseen = UNSEEN * float(np.ptp((run.tilt_rad - run.plate_rad)[near])) if near.any() else 0.0
    mean, sd = _expected(configured, chance, tried_s)[0], _expected(run, chance, tried_s)[1]
    return Slipping(configured, origin_ns, chance, tried_s, time_s, mean, max(math.hypot(sd, unseen), 1e-5))


def _expected(run: Early, chance: Array, tried_s: Array) -> tuple[float, float]:
    """Returns the mean and standard deviation of the steepest tilt until the slip."""
    tilt = np.interp(tried_s, run.grid_s, np.maximum.accumulate(run.tilt_rad))
    mean = float(chance @ tilt)
    return mean, math.sqrt(float(chance @ (tilt - mean) ** 2))

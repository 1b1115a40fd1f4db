"""The begin of a run's tilt and of its slide, which no column says: from the attitude and the block's path."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from shared.errors import UserError
from shared.geometry import Array
from station.recording.importers.tracks.plate import downhill_of, tilt_of
from station.recording.importers.tracks.runs import Times
from station.signals.downhill import DOWNHILL_RAD, usual_rad
from station.signals.traced import FITTED_NS, LEAST_SIGMA_M, Traced, trace

Bools = NDArray[np.bool_]

TURNS_RAD = 0.02
"""A plate that turns by less within a run does not tilt until the block slides; an onset at less tells nothing either
(`station.diagnosis.thresholds.LEAST_TILT_RAD`)."""

BEGINS_RAD = 2e-3
"""A tilt has begun when it has grown by this much: ten times the noise of a usual attitude."""

MOVED_M = 2e-3
"""A block has slid when it is this far from where it lay: about the 10 px of the paper's rule."""

LEAST_LYING = 4
"""The least number of frames from which a track's noise is read."""


@dataclass(frozen=True, kw_only=True)
class Slip:
    """The begin of a run's tilt; its slide and the slide's detection, ns, 0 if the block held; the onset's tilt, rad.

    `frame` is that of the onset, or of the steepest tilt; an onset that is not `resolved` lies before `detect_ns`.
    """

    tilt_ns: int
    slip_ns: int = 0
    detect_ns: int = 0
    angle_rad: float
    sigma_rad: float = 0.0
    frame: int
    resolved: bool = True


@dataclass(frozen=True, eq=False, kw_only=True)
class Motion:
    """A run: stamps (k,), attitudes (k, 4), and places (k, 2) where the block was `found` (k,)."""

    time_ns: Times
    plate: Array
    place_m: Array
    found: Bools

    @property
    def tilts(self) -> bool:
        """True if the plate is tilted during the run."""
        return bool(np.ptp(tilt_of(self.plate)) > TURNS_RAD)


def slip_of(run: Motion, *, onset: Traced | None) -> Slip:
    """Returns the slip of a run whose plate tilts."""
    tilt, seen = tilt_of(run.plate), np.flatnonzero(run.found)
    tilted = np.abs(tilt - tilt[0]) > BEGINS_RAD
    begin = max(int(np.argmax(tilted)) - 1, 0)
    rest = _rest_m(run, begin)
    tilt_ns = int(run.time_ns[begin])
    slid = np.flatnonzero(np.hypot(*(run.place_m[seen] - rest).T) > MOVED_M)
    if not len(slid) or not tilted[seen[slid[0]]]:  # a block that moves on a level plate has not slipped
        steepest = int(np.argmax(tilt))
        return Slip(tilt_ns=tilt_ns, angle_rad=float(tilt[steepest]), frame=steepest)
    detected = int(seen[slid[0]])
    moved = Slip(
        tilt_ns=tilt_ns,
        slip_ns=int(run.time_ns[detected]),
        detect_ns=int(run.time_ns[detected]),
        angle_rad=float(tilt[detected]),
        sigma_rad=float(np.ptp(tilt[begin : detected + 1])) / math.sqrt(12.0),
        frame=detected,
        resolved=False,
    )
    return moved if onset is None else _fitted(run, moved, seen[: int(slid[0]) + 1], rest, onset)


def _rest_m(run: Motion, begin: int) -> Array:
    """Returns where the block lay (2,), m, before the frame at which the plate begins to tilt."""
    seen = np.flatnonzero(run.found)
    lying = max(int(np.searchsorted(seen, begin)), 1)
    return np.asarray(np.median(run.place_m[seen[:lying]], axis=0))


def refuse_other_ways(runs: Sequence[Motion], slips: Sequence[Slip | None], source: str) -> None:
    """Refuses slides that most go elsewhere than down the plate: it stands otherwise than the table says.

    Raises:
        UserError: with the usual angle between the slides and the steepest way down.
    """
    ways = [_ways(run, slip) for run, slip in zip(runs, slips, strict=True) if slip is not None and slip.slip_ns]
    way, down = np.array(ways).reshape(-1, 2, 2).transpose(1, 0, 2)
    usual = usual_rad(way, down)
    if usual > DOWNHILL_RAD:
        raise UserError(
            f"Expected blocks that slide down the plate in {source}, got slides {math.degrees(usual):.0f}° off its "
            f"steepest way down (the median of {len(ways)} runs): downhill is (sin, -cos) of azimuth_rad, and plate_qw "
            "to plate_qz turn the plate's axes into the world's, whose z points up"
        )


def _ways(run: Motion, slip: Slip) -> tuple[Array, Array]:
    """Returns the way (2,), m, of a run's slide up to its detection, and the steepest way down (2,) then."""
    detected = int(np.searchsorted(run.time_ns, slip.detect_ns))
    rest = _rest_m(run, int(np.searchsorted(run.time_ns, slip.tilt_ns)))
    return run.place_m[detected] - rest, downhill_of(run.plate)[detected]


def released(run: Motion) -> int:
    """Returns the frame from which a block has visibly slid on a tilted plate that does not turn; 0 if there is none.

    A hand or a gate may have held it before.
    """
    seen = np.flatnonzero(run.found)
    moved = np.flatnonzero(_away_m(run) > MOVED_M)
    fixed = not run.tilts and _steepest_rad(run) > TURNS_RAD
    return int(seen[moved[0]]) if fixed and len(moved) else 0


def held(run: Motion) -> Slip | None:
    """Gives the bound on friction by a block that held on a tilted plate at rest; None if it slides, or lies level."""
    if _steepest_rad(run) <= TURNS_RAD or (_away_m(run) > MOVED_M).any():
        return None
    return Slip(tilt_ns=int(run.time_ns[0]), angle_rad=_steepest_rad(run), frame=0)


def _away_m(run: Motion) -> Array:
    """Returns the distances (m,) of the block from where it was first seen, in the frames that found it."""
    seen = run.place_m[run.found]
    return np.hypot(*(seen - seen[0]).T)


def _steepest_rad(run: Motion) -> float:
    return float(tilt_of(run.plate).max())


def _fitted(run: Motion, moved: Slip, frames: NDArray[np.int64], rest: Array, onset: Traced) -> Slip:
    """Returns the slip fitted to the path up to the last of `frames`, its detection; `moved` if it cannot be."""
    detected = int(frames[-1])
    first = int(np.searchsorted(run.time_ns, max(moved.tilt_ns, moved.detect_ns - FITTED_NS)))
    own, down = frames[frames >= first], downhill_of(run.plate)[detected]
    slide = run.place_m[detected] - rest
    way = slide / np.linalg.norm(slide)
    lying = frames[run.time_ns[frames] <= moved.tilt_ns]
    before = run.place_m[lying if len(lying) >= LEAST_LYING else own[:LEAST_LYING]] @ way
    fit = trace(
        onset,
        run.time_ns[own],
        run.place_m[own],
        start_m=rest,
        down=down,
        tilt_ns=run.time_ns[first : detected + 2],
        tilt_rad=tilt_of(run.plate[first : detected + 2]),
        sigma_m=max(float(np.std(before)), LEAST_SIGMA_M),
    )
    if fit is None:
        return moved
    return replace(
        moved,
        slip_ns=int(fit.slip_ns),
        angle_rad=float(fit.angle_rad),
        sigma_rad=float(fit.angle_sigma_rad),
        frame=min(int(np.searchsorted(run.time_ns, fit.slip_ns)), len(run.time_ns) - 1),
        resolved=True,
    )

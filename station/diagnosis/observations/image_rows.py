"""Builds the image channels: the block's mark and the plate's fiducials before the slide, and the mark's shape."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from shared.geometry import mark_corners
from shared.messages import CameraGeometry
from station.diagnosis import thresholds
from station.diagnosis.observations.channel import Channel, rows_of
from station.diagnosis.observations.marks import CREEP_POINTS, Mount, PlateMarks, Rest
from station.diagnosis.observations.moments import Moments
from station.diagnosis.observations.nearness import crept_m
from station.diagnosis.observations.plate import Times
from station.diagnosis.observations.shape import Shape
from station.diagnosis.observations.starts import leans
from station.diagnosis.observations.stretches import (
    BEFORE_SLIP_NS,
    LEAST_FRAMES,
    STRETCH,
    Stretches,
    between,
    mean_attitude,
    spans,
    stretch,
    view_of,
)
from station.diagnosis.observations.track_noise import corner_sigma_px
from station.diagnosis.observations.tracks import RunTrack
from station.diagnosis.observations.views import fixed_view
from station.physics.contact import Array
from station.physics.covariates import covariates_of

if TYPE_CHECKING:
    from station.diagnosis.observations.build import Recorded

FIXED = np.dtype(
    [
        ("run", np.int64), ("from_ns", np.int64), ("to_ns", np.int64), ("level", np.float64, (4, 2)),
        ("now", np.float64, (4, 2)), ("sigma_px", np.float64),
    ]
)  # fmt: skip
"""A fiducial in one stretch of a tilt: its mean corners level and now, and the standard error of their difference."""


def rest_channel(recorded: Recorded) -> Sequence[Channel]:
    """Returns the block's apparent motion before the onset, for runs in which the foam does not hold it."""
    found = [pair for run, track in enumerate(recorded.tracks) for pair in _resting(recorded, run, track)]
    if not found:
        return []
    before, now = (np.array(list(rows), dtype=STRETCH) for rows in zip(*found, strict=True))
    view, level = view_of(now, recorded), view_of(before, recorded)
    moved = now["pose"][:, :2] - before["pose"][:, :2]
    sigma = now["sigma_m"] * np.sqrt(1 / now["frames"] + 1 / before["frames"])
    creeping, creep_s = _creeping(now, _places(before, now), recorded)
    known = {
        name: values[CREEP_POINTS - 1 :: CREEP_POINTS] for name, values in covariates_of(creeping.reported).items()
    }
    crept = crept_m(recorded, now)
    columns = {**_span(now), "sigma": np.hypot(sigma, thresholds.PLACE_TRUSTED_M), "astray": crept}
    rows = rows_of(columns, {**known, "tilt": view.tilt_rad})
    limit_rad = np.repeat(view.limit_rad, CREEP_POINTS)
    down_m = (moved * view.down).sum(axis=1)
    return [
        Rest(
            rows,
            down_m,
            view=replace(view, crept_m=crept),
            start=level,
            creeping=creeping,
            creep_s=creep_s,
            limit_rad=limit_rad,
            slow=recorded.slow_slides,
        )
    ]


def _resting(recorded: Recorded, run: int, track: RunTrack) -> Iterator[tuple[Any, Any]]:
    """Yields a run's stretch with the plate level beside each stretch of its tilt."""
    level = stretch(run, track, track.level_ns, track.tilt_ns)
    until = (track.slip_ns or track.end_ns) - BEFORE_SLIP_NS
    if level is None or until <= track.tilt_ns or track.sample.censored or leans(track, recorded.setting):
        return
    for span in spans(track.tilt_ns, until):
        if (now := stretch(run, track, *span)) is not None:
            yield level, now


def _places(before: Stretches, now: Stretches) -> Array:
    """Returns where each run's block rested (n, 2), m: the mean of all frames of its stretches.

    That mean's noise is uncorrelated with any stretch's motion `now` less `before`, as each stretch has as many frames
    as its precision says. A stretch's own place has half its noise in common with its motion: where all blocks start
    from one spot, they seemed to move by where they stand.
    """
    _, first, run = np.unique(now["run"], return_index=True, return_inverse=True)
    begin = before[first]
    frames = begin["frames"] + np.bincount(run, now["frames"])
    total = begin["frames"][:, None] * begin["pose"][:, :2]
    np.add.at(total, run, now["frames"][:, None] * now["pose"][:, :2])
    return np.asarray((total / frames[:, None])[run])


def _creeping(stretches: Stretches, place_m: Array, recorded: Recorded) -> tuple[Moments, Array]:
    """Returns CREEP_POINTS moments for each stretch, the block at rest, and how long (n, CREEP_POINTS), s, each counts.

    The block stays at `place_m` (n, 2).

    They lie evenly between the begin of the tilt and the stretch's end, but for the last, which is the stretch's middle
    and does not count. The stretch's mean motion has all that was crept before it, and of what is crept in it the share
    of the stretch that comes after.
    """
    count = CREEP_POINTS - 1
    begin, first, last = (stretches[name][:, None] for name in ("tilt_ns", "from_ns", "to_ns"))
    even = between(stretches["tilt_ns"], stretches["to_ns"], count).reshape(-1, count)
    after = np.clip((last - even) / np.maximum(last - first, 1), 0.0, 1.0)
    weight_s = np.column_stack([1e-9 / count * (last - begin) * after, np.zeros(len(stretches))])
    time_ns = np.column_stack([even, (first + last) // 2]).ravel()
    yaw_rad, plate = np.repeat(stretches["pose"][:, 2], CREEP_POINTS), recorded.plate
    moments = Moments(
        time_ns=time_ns,
        run=np.repeat(stretches["run"], CREEP_POINTS),
        facts=recorded.facts,
        attitude=lambda delay_s: plate.at(time_ns, delay_s=delay_s),
        place_m=np.repeat(place_m, CREEP_POINTS, axis=0),
        yaw_rad=yaw_rad,
    )
    return moments, weight_s


def plate_channels(recorded: Recorded) -> Sequence[Channel]:
    """Returns the apparent motion of the first usable fiducial on the plate, within runs and between.

    The camera causes it.
    """
    geometry = recorded.signals.geometry
    for fiducial in recorded.signals.fiducials.values():
        seen = fiducial.select(fiducial.found)
        if geometry is None or len(seen) < LEAST_FRAMES or not len(recorded.plate):
            continue
        parts = _fixed(recorded, seen.time_ns, seen.on_plate(geometry), corner_sigma_px(seen))
        if len(parts):
            return [_plate_marks(recorded, parts, geometry), *_mounts(recorded, parts, geometry)]
    return []


def _fixed(recorded: Recorded, time_ns: Times, corner_m: Array, sigma_px: Array) -> Stretches:
    """Returns the stretches (n,) of a fiducial, with the fields of FIXED."""

    def mean(from_ns: int, to_ns: int) -> tuple[Array, float] | None:
        first, last = np.searchsorted(time_ns, (from_ns, to_ns))
        good = np.isfinite(corner_m[first:last]).all(axis=(1, 2))
        seen, single_px = corner_m[first:last][good], sigma_px[first:last][good]
        return (seen.mean(axis=0), float(np.median(single_px)) / math.sqrt(len(seen))) if len(seen) else None

    rows = [
        (run, *span, level[0], now[0], math.hypot(level[1], now[1]))
        for run, track in enumerate(recorded.tracks)
        if (level := mean(track.level_ns, track.tilt_ns)) is not None
        for span in spans(track.tilt_ns, track.slip_ns or track.end_ns)
        if (now := mean(*span)) is not None
    ]
    return np.array(rows, dtype=FIXED)


def _plate_marks(recorded: Recorded, parts: Stretches, geometry: CameraGeometry) -> PlateMarks:
    tilt_rad, down_rad = mean_attitude(recorded, parts["from_ns"], parts["to_ns"])
    height_px = recorded.setting.image_height_px
    view = fixed_view(parts["now"], geometry, image_height_px=height_px, tilt_rad=tilt_rad, down_rad=down_rad)
    level = fixed_view(
        parts["level"], geometry, image_height_px=height_px, tilt_rad=np.zeros_like(tilt_rad), down_rad=down_rad
    )
    moved = (parts["now"] - parts["level"]).mean(axis=1)
    sigma = parts["sigma_px"] * geometry.mm_per_px * 0.5e-3
    covariates = {"tilt": tilt_rad, "direction": down_rad, "run": recorded.facts.number[parts["run"]]}
    rows = rows_of({**_span(parts), "sigma": np.hypot(sigma, thresholds.PLACE_TRUSTED_M)}, covariates)
    return PlateMarks(rows, (moved * view.down).sum(axis=1), view, level)


def _mounts(recorded: Recorded, parts: Stretches, geometry: CameraGeometry) -> Iterator[Mount]:
    """Yields the fiducial's places before the runs' tilts, by the plate's axes."""
    level = parts[np.unique(parts["run"], return_index=True)[1]]
    sigma = np.hypot(level["sigma_px"] * geometry.mm_per_px * 0.5e-3, thresholds.PLACE_TRUSTED_M)
    run, facts = level["run"], recorded.facts
    rows = rows_of({**_span(level), "sigma": sigma}, {"run": facts.number[run]})
    for axis, place_m in zip("xy", level["level"].mean(axis=1).T, strict=True):
        yield Mount(rows, axis, place_m, facts.mount_rad[run])


def shape_channel(recorded: Recorded) -> Sequence[Channel]:
    """Returns the mark's strain with the plate level, just before the slide, and in every window of the slide."""
    geometry = recorded.signals.geometry
    found = np.array([row for each in enumerate(recorded.tracks) for row in _shaped(recorded, *each)], dtype=STRETCH)
    if geometry is None or len(found) < LEAST_FRAMES:
        return []
    view = view_of(found, recorded)
    sigma = found["corner_sigma_m"] / geometry.marker_side_m / np.sqrt(found["frames"])
    covariates = {
        "x": view.centre_m[:, 0],
        "y": view.centre_m[:, 1],
        "speed": np.linalg.norm(view.velocity_m_s, axis=1),
        "tilt": view.tilt_rad,
        "direction": view.down_rad,
        "run": recorded.facts.number[found["run"]],
    }
    columns = {**_span(found), "sigma": np.hypot(sigma, thresholds.STRAIN_TRUSTED)}
    every = np.repeat(np.arange(len(found)), 3)
    rows = rows_of(columns, covariates).chosen(every)
    mark_m = mark_corners(side_m=geometry.marker_side_m, aspect=geometry.marker_aspect)
    return [Shape(rows, found["corner_m"], mark_m=mark_m, view=view, spread_s=found["spread_s"])]


def _shaped(recorded: Recorded, run: int, track: RunTrack) -> Iterator[Any]:
    """Yields the stretches of a run in which the mark's shape is seen."""
    if track.corner_m is None:
        return
    until = track.slip_ns or track.end_ns
    still = [(track.level_ns, track.tilt_ns), ((track.tilt_ns + until) // 2, until - BEFORE_SLIP_NS)]
    yield from (row for span in still if (row := stretch(run, track, *span)) is not None)
    for window in recorded.windows[recorded.windows["run"] == run]:
        if (row := stretch(run, track, window["from_ns"], window["to_ns"] + 1, moving=True)) is not None:
            yield row


def _span(stretches: Stretches) -> dict[str, Times]:
    return {name: stretches[name] for name in ("run", "from_ns", "to_ns")}

"""Builds the image channels: the block's mark and the plate's fiducials before the slide, and the mark's shape."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from shared.messages import CameraGeometry
from station.diagnosis import thresholds
from station.diagnosis.observations.channel import Channel, rows_of
from station.diagnosis.observations.marks import (
    CREEP_POINTS,
    PlateMarks,
    Rest,
    Shape,
    strain_of,
)
from station.diagnosis.observations.moments import Moments
from station.diagnosis.observations.plate import Times
from station.diagnosis.observations.starts import leans
from station.diagnosis.observations.tracks import RunTrack
from station.diagnosis.observations.views import IMAGE_PX, block_view
from station.diagnosis.observations.windows import windows_of
from station.physics.contact import Array, View
from station.physics.covariates import covariates_of

if TYPE_CHECKING:
    from station.diagnosis.observations.build import Recorded

STRETCHES = 4
LEAST_FRAMES = 3
MEAN_POINTS = 24
BEFORE_SLIP_NS = 30_000_000


@dataclass(frozen=True, eq=False)
class _Stretch:
    """A stretch of frames of one run, with the means over it; `place` is the run's place in the evidence."""

    place: int
    track: RunTrack
    from_ns: int
    to_ns: int
    pose: Array
    frames: int
    corner_m: Array | None
    velocity: Array
    yaw_rate: float
    spread_s: float
    """Standard deviation of the frames' times."""


def rest_channel(recorded: Recorded) -> Sequence[Channel]:
    """The block's apparent motion before the onset, for runs in which the foam does not hold it."""
    pairs: list[tuple[_Stretch, _Stretch]] = []
    for place, track in enumerate(recorded.tracks):
        start = _stretch(place, track, track.level_ns, track.tilt_ns)
        until = (track.slip_ns or track.end_ns) - BEFORE_SLIP_NS
        held = track.sample.censored or leans(track, recorded.setting)
        if start is None or until <= track.tilt_ns or held:
            continue
        edges = np.linspace(track.tilt_ns, until, STRETCHES + 1).astype(np.int64).tolist()
        stretches = (_stretch(place, track, *pair) for pair in itertools.pairwise(edges))
        pairs += [(start, stretch) for stretch in stretches if stretch is not None]
    if not pairs:
        return []
    starts, stretches = [start for start, _ in pairs], [stretch for _, stretch in pairs]
    view, start_view = _view(stretches, recorded), _view(starts, recorded)
    moved = np.array([stretch.pose[:2] - start.pose[:2] for start, stretch in pairs])
    sigma = np.array([s.track.sigma_m * np.sqrt(1 / s.frames + 1 / b.frames) for b, s in pairs])
    creeping, creep_s = _creeping(stretches, recorded)
    rows = rows_of(
        {**_span(stretches), "sigma": np.hypot(sigma, thresholds.PLACE_TRUSTED_M)},
        {name: values[CREEP_POINTS - 1 :: CREEP_POINTS] for name, values in covariates_of(creeping.reported).items()}
        | {"tilt": view.tilt_rad},
    )
    slip_ns = np.array([stretch.track.slip_ns or stretch.track.end_ns for stretch in stretches], dtype=np.int64)
    limit_rad = np.repeat(recorded.plate.at(slip_ns).tilt_rad, CREEP_POINTS)
    down_m = (moved * view.down).sum(axis=1)
    return [Rest(rows, down_m, view=view, start=start_view, creeping=creeping, creep_s=creep_s, limit_rad=limit_rad)]


def plate_channel(recorded: Recorded) -> Sequence[Channel]:
    """The apparent motion of the first usable fiducial on the plate, which only the camera can cause."""
    geometry = recorded.signals.geometry
    if geometry is None:
        return []
    channels: list[Channel] = []
    for fiducial in recorded.signals.fiducials.values():
        seen = fiducial.select(fiducial.found)
        if len(seen) < LEAST_FRAMES or not len(recorded.plate):
            continue
        channels += _fiducial(
            recorded, seen.time_ns, seen.on_plate(geometry), float(np.nanmedian(seen.sigma_px)), geometry
        )
    return channels[:1]


def _fiducial(
    recorded: Recorded, time_ns: Times, corner_m: Array, sigma_px: float, geometry: CameraGeometry
) -> Sequence[Channel]:
    rows: list[tuple[int, int, int, Array, Array, float]] = []
    for place, track in enumerate(recorded.tracks):
        level = _mean_corners(time_ns, corner_m, track.level_ns, track.tilt_ns)
        until = track.slip_ns or track.end_ns
        edges = np.linspace(track.tilt_ns, until, STRETCHES + 1).astype(np.int64).tolist()
        for begin, end in itertools.pairwise(edges):
            now = _mean_corners(time_ns, corner_m, begin, end)
            if level is not None and now is not None:
                rows.append((place, begin, end, level[0], now[0], np.sqrt(1 / level[1] + 1 / now[1])))
    if not rows:
        return []
    run, from_ns, to_ns, level_m, now_m, factor = zip(*rows, strict=True)
    spans = list(zip(from_ns, to_ns, strict=True))
    before, after = np.array(level_m), np.array(now_m)
    views = [_fixed_view(points, recorded, spans, geometry) for points in (after, before)]
    moved = (after - before).mean(axis=1)
    sigma = np.array(factor) * sigma_px * geometry.mm_per_px * 0.5e-3
    columns = {
        "run": np.array(run),
        "from_ns": np.array(from_ns),
        "to_ns": np.array(to_ns),
        "sigma": np.hypot(sigma, thresholds.PLACE_TRUSTED_M),
    }
    covariates = {
        "tilt": views[0].tilt_rad,
        "direction": views[0].down_rad,
        "run": recorded.facts.number[np.array(run)],
    }
    return [PlateMarks(rows_of(columns, covariates), (moved * views[0].down).sum(axis=1), views[0], _level(views[1]))]


def shape_channel(recorded: Recorded) -> Sequence[Channel]:
    """The mark's strain with the plate level, just before the slide, and in every window of the slide."""
    geometry = recorded.signals.geometry
    if geometry is None:
        return []
    found: list[_Stretch] = []
    for place, track in enumerate(recorded.tracks):
        if track.corner_m is None:
            continue
        until = track.slip_ns or track.end_ns
        spans = [(track.level_ns, track.tilt_ns, 0.0), ((track.tilt_ns + until) // 2, until - BEFORE_SLIP_NS, 0.0)]
        spans += [(window.from_ns, window.to_ns + 1, 1.0) for window in windows_of(track)]
        stretches = (_stretch(place, track, begin, end, moving=moving > 0) for begin, end, moving in spans)
        found += [stretch for stretch in stretches if stretch is not None]
    if len(found) < LEAST_FRAMES:
        return []
    view = _view(found, recorded)
    yaw = np.array([stretch.pose[2] for stretch in found])
    seen = np.array([stretch.corner_m for stretch in found])
    side = geometry.marker_side_m
    sigma = np.array([s.track.corner_sigma_m / side / np.sqrt(s.frames) for s in found])
    span = _span(found)
    thrice = {name: np.repeat(values, 3) for name, values in span.items()}
    speed = np.linalg.norm(view.velocity_m_s, axis=1)
    covariates = {
        "x": view.centre_m[:, 0],
        "y": view.centre_m[:, 1],
        "speed": speed,
        "tilt": view.tilt_rad,
        "direction": view.down_rad,
        "run": recorded.facts.number[span["run"]],
    }
    rows = rows_of(
        {**thrice, "sigma": np.repeat(np.hypot(sigma, thresholds.STRAIN_TRUSTED), 3)},
        {name: np.repeat(values, 3) for name, values in covariates.items()},
    )
    spread_m = view.velocity_m_s * np.array([stretch.spread_s for stretch in found])[:, None]
    return [Shape(rows, strain_of(view.point_m, seen, yaw), view, yaw, spread_m)]


def _stretch(place: int, track: RunTrack, from_ns: int, to_ns: int, *, moving: bool = False) -> _Stretch | None:
    frames = track.frames(from_ns, to_ns)
    count = frames.stop - frames.start
    if count < LEAST_FRAMES:
        return None
    times, pose = track.time_ns[frames], track.pose[frames]
    velocity, yaw_rate = np.zeros(2), 0.0
    mean = pose.mean(axis=0)
    seconds = (times - times[0]) * 1e-9
    if moving:
        slopes = np.polyfit(seconds, pose, 1)[0]
        velocity, yaw_rate = slopes[:2], float(slopes[2])
    corners = None
    if track.corner_m is not None:
        corners = mean[:2] + _mean_shape(track.corner_m[frames], yaw_rate * (seconds - seconds.mean()))
    return _Stretch(
        place, track, int(times[0]), int(times[-1]), mean, count, corners, velocity, yaw_rate, float(seconds.std())
    )


def _mean_shape(seen: Array, turned_rad: Array) -> Array:
    """The mean corners (4, 2) around their centre of corners (n, 4, 2) that have turned by `turned_rad` (n,).

    Each frame's corners are turned back: the mean of a square in many headings is a smaller square.
    """
    offset = seen - seen.mean(axis=1, keepdims=True)
    cosine, sine = np.cos(turned_rad), np.sin(turned_rad)
    back = np.stack([np.stack([cosine, -sine], axis=-1), np.stack([sine, cosine], axis=-1)], axis=-2)
    return (offset @ back).mean(axis=0)


def _span(stretches: Sequence[_Stretch]) -> dict[str, Times]:
    return {
        "run": np.array([stretch.place for stretch in stretches]),
        "from_ns": np.array([stretch.from_ns for stretch in stretches]),
        "to_ns": np.array([stretch.to_ns for stretch in stretches]),
    }


def _view(stretches: Sequence[_Stretch], recorded: Recorded) -> View:
    middle = np.array([(stretch.from_ns + stretch.to_ns) // 2 for stretch in stretches], dtype=np.int64)
    tilt_rad, down_rad = _mean_attitude(recorded, [(stretch.from_ns, stretch.to_ns) for stretch in stretches])
    tilt_ns = np.array([stretch.track.tilt_ns for stretch in stretches], dtype=np.int64)
    return block_view(
        recorded,
        np.array([stretch.pose for stretch in stretches]),
        velocity_m_s=np.array([stretch.velocity for stretch in stretches]),
        yaw_rate_rad_s=np.array([stretch.yaw_rate for stretch in stretches]),
        tilt_rad=tilt_rad,
        down_rad=down_rad,
        rest_s=np.maximum((middle - tilt_ns) * 1e-9, 0.0),
    )


def _mean_attitude(recorded: Recorded, spans: Sequence[tuple[int, int]]) -> tuple[Array, Array]:
    """Tilt and direction of descent (n,), rad, of gravity's mean over stretches (ns): the plate may move in them."""
    shares = (np.arange(MEAN_POINTS) + 0.5) / MEAN_POINTS
    begin, end = np.array(spans, dtype=np.int64).T
    times = begin[:, None] + np.round(shares * (end - begin)[:, None]).astype(np.int64)
    gravity = recorded.plate.at(times.ravel()).gravity.reshape(len(spans), MEAN_POINTS, 3).mean(axis=1)
    level = np.hypot(gravity[:, 0], gravity[:, 1])
    return np.arctan2(level, -gravity[:, 2]), np.arctan2(gravity[:, 1], gravity[:, 0])


def _fixed_view(points: Array, recorded: Recorded, spans: Sequence[tuple[int, int]], geometry: CameraGeometry) -> View:
    tilt_rad, down_rad = _mean_attitude(recorded, spans)
    count = len(points)
    return View(
        point_m=points,
        on_block=False,
        velocity_m_s=np.zeros((count, 2)),
        yaw_rate_rad_s=np.zeros(count),
        tilt_rad=tilt_rad,
        down_rad=down_rad,
        rest_s=np.zeros(count),
        side_m=geometry.marker_side_m,
        camera_height_m=geometry.camera_height_m or 0.3,
        image_centre_m=np.array([geometry.camera_x_m, geometry.camera_y_m]),
        row_m=np.array([0.0, -1.0]),
        image_size_m=IMAGE_PX * geometry.mm_per_px * 1e-3,
    )


def _level(view: View) -> View:
    """The same mark with the plate level."""
    return replace(view, tilt_rad=np.zeros_like(view.tilt_rad), rest_s=np.zeros_like(view.rest_s))


def _mean_corners(time_ns: Times, corner_m: Array, from_ns: int, to_ns: int) -> tuple[Array, int] | None:
    first, last = np.searchsorted(time_ns, (from_ns, to_ns))
    seen = corner_m[first:last]
    seen = seen[np.isfinite(seen).all(axis=(1, 2))]
    return (seen.mean(axis=0), len(seen)) if len(seen) else None


def _creeping(stretches: Sequence[_Stretch], recorded: Recorded) -> tuple[Moments, Array]:
    """CREEP_POINTS moments for each stretch, the block at rest, and for how long (n, CREEP_POINTS), s, each counts.

    They lie evenly between the begin of the tilt and the stretch's end, but for the last, which is the stretch's middle
    and does not count. The stretch's mean motion has all that was crept before it, and of what is crept in it the share
    of the stretch that comes after.
    """
    count = CREEP_POINTS - 1
    begin = np.array([stretch.track.tilt_ns for stretch in stretches], dtype=np.int64)[:, None]
    first, last = np.array([(stretch.from_ns, stretch.to_ns) for stretch in stretches], dtype=np.int64).T[:, :, None]
    even = begin + np.round((np.arange(count) + 0.5) / count * (last - begin)).astype(np.int64)
    after = np.clip((last - even) / np.maximum(last - first, 1), 0.0, 1.0)
    weight_s = np.column_stack([1e-9 / count * (last - begin) * after, np.zeros(len(stretches))])
    time_ns = np.column_stack([even, (first + last) // 2]).ravel()
    pose = np.repeat(np.array([stretch.pose for stretch in stretches]), CREEP_POINTS, axis=0)
    moments = Moments(
        time_ns=time_ns,
        run=np.repeat(np.array([stretch.place for stretch in stretches], dtype=np.int64), CREEP_POINTS),
        facts=recorded.facts,
        attitude=lambda delay_s: recorded.plate.at(time_ns, delay_s=delay_s),
        place_m=pose[:, :2],
        yaw_rad=pose[:, 2],
        velocity_m_s=np.zeros((len(time_ns), 2)),
        moving=np.zeros(len(time_ns), dtype=np.bool_),
        slip_ns=time_ns,
        border_m=np.full(len(time_ns), np.inf),
    )
    return moments, weight_s

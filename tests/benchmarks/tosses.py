"""Label-permuted copies of a table of tosses: what could explain the slides is dealt out anew, the noise is kept.

On a level board one constant friction knows no place, direction, heading or order. So a copy in which every toss is

- turned about the vertical by an angle of its own, and moved to where another toss began to slide,
- given a heading against its way that is drawn anew, and a new place in the order,

is as good a sample of that null as the tosses are, with the tracking's own noise. The speed within a slide cannot be
dealt out between tosses; instead what a slide has beside constant friction (its path less a parabola in time) keeps its
size and gets a sign of its own, by which a law that all tosses share is gone (Wu 1986, Ann. Stat. 14, 1261: the wild
bootstrap).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from shared.geometry import Array
from station.recording.importers.cube_tosses import CUBE_SIDE_M, RATE_HZ

POSE = ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")
SETTLED_FRAMES = 8
"""Some 50 ms after a landing still hold the impact."""
LEAST_FRAMES = 10
_FLAT_M, _FLAT_RAD, _STOPPED_M = 3e-3, np.radians(3.0), 1e-3


@dataclass(frozen=True, eq=False)
class Toss:
    """The poses (n, 7) of a toss at frames (n,), and its slide: frames `slide` of it, empty if it never slid flat."""

    frame: Array
    pose: Array
    slide: slice


def tosses_of(path: Path) -> list[Toss]:
    """The tosses of a table, in its order."""
    table = pq.read_table(path)
    number, frame = (table[name].to_numpy().astype(float) for name in ("toss", "frame"))
    order = np.lexsort((frame, number))
    pose = np.column_stack([table[name].to_numpy().astype(float) for name in POSE])[order]
    starts = np.flatnonzero(np.diff(number[order], prepend=-np.inf))[1:]
    parts = zip(np.split(frame[order], starts), np.split(pose, starts), strict=True)
    return [Toss(frames, poses, slide_of(poses)) for frames, poses in parts]


def slide_of(pose: Array) -> slice:
    """The last stretch in which the cube lies on a face, from when it has settled until it stops."""
    w, x, y, z = pose[:, 3:].T
    upward = np.column_stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
    flat = (np.abs(upward).max(axis=1) > np.cos(_FLAT_RAD)) & (np.abs(pose[:, 2] - 0.5 * CUBE_SIDE_M) < _FLAT_M)
    begin = int(np.flatnonzero(~flat)[-1]) + 1 if not flat.all() else 0
    begin += SETTLED_FRAMES
    away = np.linalg.norm(pose[:, :2] - pose[-1, :2], axis=1) > _STOPPED_M
    end = int(np.flatnonzero(away)[-1]) + 1 if away.any() else 0
    return slice(begin, end) if end - begin >= LEAST_FRAMES else slice(0, 0)


def permuted(tosses: list[Toss], rng: np.random.Generator) -> list[Toss]:
    """A copy with everything dealt out anew that constant friction does not know."""
    slid = [toss for toss in tosses if toss.slide.stop]
    places = iter([slid[number].pose[slid[number].slide.start, :2] for number in rng.permutation(len(slid)).tolist()])
    found = [_dealt(toss, next(places) if toss.slide.stop else None, rng) for toss in tosses]
    return [found[number] for number in rng.permutation(len(found)).tolist()]


def _dealt(toss: Toss, place: Array | None, rng: np.random.Generator) -> Toss:
    turn, heading, sign = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.0, 2.0 * np.pi), rng.choice([-1.0, 1.0])
    pose = _resigned(toss, sign)
    cosine, sine = np.cos(turn), np.sin(turn)
    way = pose[:, :2] @ np.array([[cosine, sine], [-sine, cosine]])
    if place is not None:
        way += place - way[toss.slide.start]
    return Toss(toss.frame, np.column_stack([way, pose[:, 2], turned(pose[:, 3:], turn + heading)]), toss.slide)


def _resigned(toss: Toss, sign: float) -> Array:
    """What the slide has beside a parabola in time, in place and heading, times a sign."""
    pose = toss.pose.copy()
    part = toss.slide
    if part.stop:
        seconds = (toss.frame[part] - toss.frame[part][0]) / RATE_HZ
        heading = heading_of(pose[part, 3:])
        values = np.column_stack([pose[part, :2], heading])
        basis = np.column_stack([np.ones_like(seconds), seconds, seconds**2])
        change = (sign - 1.0) * (values - basis @ np.linalg.lstsq(basis, values, rcond=None)[0])
        pose[part, :2] += change[:, :2]
        pose[part, 3:] = turned(pose[part, 3:], change[:, 2])
    return pose


def heading_of(quaternion: Array) -> Array:
    """The heading (n,) of whichever of the cube's axes lies flattest at first, continuous."""
    w, x, y, z = quaternion.T
    along = np.stack(
        [1 - 2 * (y * y + z * z) + 1j * 2 * (x * y + w * z), 2 * (x * y - w * z) + 1j * (1 - 2 * (x * x + z * z))]
    )
    return np.unwrap(np.angle(along[np.abs(along[:, 0]).argmax()]))


def turned(quaternion: Array, angle_rad: Array | float) -> Array:
    """Quaternions (n, 4) after a turn about the vertical."""
    cosine, sine = np.cos(0.5 * np.asarray(angle_rad)), np.sin(0.5 * np.asarray(angle_rad))
    w, x, y, z = quaternion.T
    return np.column_stack([cosine * w - sine * z, cosine * x - sine * y, cosine * y + sine * x, cosine * z + sine * w])


def write_table(tosses: list[Toss], path: Path) -> Path:
    """As a table that `station import cube-tosses` reads; the tosses numbered in their order."""
    number = np.concatenate([np.full(len(toss.frame), place) for place, toss in enumerate(tosses)])
    pose = np.concatenate([toss.pose for toss in tosses])
    columns = {"toss": number, "frame": np.concatenate([toss.frame for toss in tosses])}
    columns |= dict(zip(POSE, pose.T, strict=True))
    pq.write_table(pa.table({name: pa.array(values) for name, values in columns.items()}), path)
    return path

"""Label-permuted copies of a table of tosses: what could explain the slides is dealt out anew, the noise is kept.

On a level board one constant friction for each toss knows no speed, place, direction, heading or order. So a copy in
which every toss

- is slowed down as another toss is, from its own speed,
- is turned about the vertical by an angle of its own, and moved to where another toss began to slide,
- has a heading against its way that is drawn anew, and a new place in the order,

is as good a sample of that null as the tosses are, with the tracking's own noise. What a slide has beside constant
friction is its path less a parabola in time. What all tosses have of that in common, which a law of the speed leaves,
is taken off; the rest keeps its size, frame by frame, and gets a sign of its own (Wu 1986, Ann. Stat. 14, 1261: the
wild bootstrap).
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
_LEAST_M_S2 = 0.2
_SHARES = np.linspace(0.0, 1.0, 21)


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
    levels = np.array([_fitted(toss)[1] for toss in slid])
    ratios = iter((levels[rng.permutation(len(slid))] / levels).tolist())
    common = np.median([_along(toss) for toss in slid], axis=0)
    found = [
        _dealt(_slowed(toss, next(ratios), common, rng), next(places), rng) if toss.slide.stop else toss
        for toss in tosses
    ]
    return [found[number] for number in rng.permutation(len(found)).tolist()]


def _dealt(toss: Toss, place: Array, rng: np.random.Generator) -> Toss:
    turn, heading = rng.uniform(0.0, 2.0 * np.pi, 2)
    cosine, sine = np.cos(turn), np.sin(turn)
    way = toss.pose[:, :2] @ np.array([[cosine, sine], [-sine, cosine]])
    way += place - way[toss.slide.start]
    pose = np.column_stack([way, toss.pose[:, 2], turned(toss.pose[:, 3:], turn + heading)])
    return Toss(toss.frame, pose, toss.slide)


def _fitted(toss: Toss) -> tuple[Array, float]:
    """Coefficients (3, 3) of a parabola in time of x, y and heading over the slide, and the deceleration."""
    seconds = (toss.frame[toss.slide] - toss.frame[toss.slide][0]) / RATE_HZ
    values = np.column_stack([toss.pose[toss.slide, :2], heading_of(toss.pose[toss.slide, 3:])])
    fit: Array = np.asarray(np.linalg.lstsq(_basis(seconds), values, rcond=None)[0], dtype=np.float64)
    return fit, max(2.0 * float(np.linalg.norm(fit[2, :2])), _LEAST_M_S2)


def _basis(seconds: Array) -> Array:
    return np.column_stack([np.ones_like(seconds), seconds, seconds**2])


def _beside(toss: Toss, fit: Array) -> Array:
    """What the slide's x, y and heading (n, 3) have beside the parabola."""
    seconds = (toss.frame[toss.slide] - toss.frame[toss.slide][0]) / RATE_HZ
    values = np.column_stack([toss.pose[toss.slide, :2], heading_of(toss.pose[toss.slide, 3:])])
    return values - _basis(seconds) @ fit


def _along(toss: Toss) -> Array:
    """That of the path, along the deceleration and in its unit a T², at `_SHARES` of the slide's time T."""
    fit, level = _fitted(toss)
    along = _beside(toss, fit)[:, :2] @ fit[2, :2] / max(float(np.linalg.norm(fit[2, :2])), 1e-9)
    share, length = _shares(toss)
    return np.interp(_SHARES, share, along) / (level * length**2)


def _shares(toss: Toss) -> tuple[Array, float]:
    """The slide's frames as shares of its time (n,), and that time."""
    seconds = (toss.frame[toss.slide] - toss.frame[toss.slide][0]) / RATE_HZ
    return seconds / seconds[-1], float(seconds[-1])


def _slowed(toss: Toss, ratio: float, common: Array, rng: np.random.Generator) -> Toss:
    """The slide with `ratio` times its deceleration, and a sign drawn for what it has beside parabola and `common`.

    It is so much shorter in time; where it is longer, what it has beside the parabola is used again from its end on.
    """
    ratio, part = float(np.clip(ratio, 0.5, 2.0)), toss.slide
    count = part.stop - part.start
    fit, level = _fitted(toss)
    heading, beside = heading_of(toss.pose[part, 3:]), _beside(toss, fit)
    share, length = _shares(toss)
    toward = fit[2, :2] / max(float(np.linalg.norm(fit[2, :2])), 1e-9)
    beside[:, :2] -= (level * length**2 * np.interp(share, _SHARES, common))[:, None] * toward
    new = max(round(count / ratio), LEAST_FRAMES)
    source = np.arange(new) % (2 * count)
    source = np.where(source < count, source, 2 * count - 1 - source)
    now = np.arange(new) / RATE_HZ
    slower = _basis(now) @ (fit * np.array([[1.0, 1.0, 1.0], [1.0, 1.0, ratio], [1.0, 1.0, ratio**2]]))
    slower[:, :2] += (ratio - 1.0) * (now**2)[:, None] * fit[2, :2]
    slower += rng.choice([-1.0, 1.0]) * beside[source]
    base = toss.pose[part][source]
    slid = np.column_stack([slower[:, :2], base[:, 2], turned(base[:, 3:], slower[:, 2] - heading[source])])
    rest = toss.pose[part.stop :].copy()
    rest[:, :2] += slid[-1, :2] - toss.pose[part.stop - 1, :2]
    first = toss.frame[part.start]
    frames = [toss.frame[: part.start], first + np.arange(new), first + new + np.arange(len(rest))]
    pose = np.concatenate([toss.pose[: part.start], slid, rest])
    return Toss(np.concatenate(frames), pose, slice(part.start, part.start + new))


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

"""Label-permuted copies of a table of tosses: what could explain the slides is dealt out anew, the noise is kept.

On a level board one constant friction for each toss knows no speed, place, direction, heading or order, and no left and
right. So a copy in which every toss

- is slowed down as another toss is, from its own speed, straight on,
- is turned about the vertical by an angle of its own, and moved to where another toss began to slide,
- turns itself to the left or to the right, as a coin says,
- has a heading against its way that is drawn anew, and a new place in the order,

is as good a sample of that null as the tosses are, with the tracking's own noise. What a slide has beside constant
friction is kept, frame by frame, along the way, aside and in heading, with signs of their own (Wu 1986, Ann. Stat. 14,
1261: the wild bootstrap); only what all tosses have in common along their ways, which a law of the speed leaves, is
taken off before. The whole swerve of a slide counts as beside: the tosses swerve to one side on the average, and the
more the more they turn, so a copy that kept a slide's curve would not be one of constant friction.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from shared.geometry import Array
from station.physics.sole import TURNING_RADIUS
from station.recording.importers.cube_tosses import CUBE_SIDE_M, RATE_HZ

POSE = ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")
SETTLED_FRAMES = 8
"""Some 50 ms after a landing still hold the impact."""
LEAST_FRAMES = 10
STANDING_FRAMES = 8
"""A slide counts until a millimetre before its end: so much later the cube stands."""

_FLAT_M, _FLAT_RAD, _STOPPED_M = 3e-3, np.radians(3.0), 1e-3
_LEAST_M_S2, _LEAST_M_S = 0.2, 0.02
_RATIOS = (0.5, 2.0)
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
    plain = [Plain.of(toss) for toss in slid]
    levels = np.array([one.level_m_s2 for one in plain])
    ratios = iter(np.clip(levels[rng.permutation(len(slid))] / levels, *_RATIOS).tolist())
    common = np.median([one.shape() for one in plain], axis=0)
    fits = iter(plain)
    found = [
        _dealt(_slowed(toss, next(fits), next(ratios), common, rng), next(places), rng) if toss.slide.stop else toss
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


@dataclass(frozen=True, eq=False)
class Plain:
    """A slide as constant friction has it: straight on along `way` (2,), its heading even in time, and the rest.

    `along` (3,) are place, speed and deceleration at its beginning, and `pull` (n,) what a deceleration of 1 would have
    taken off the way by each frame: of a block that turns, friction against the sliding is only a share (Howe &
    Cutkosky 1996, IJRR 15, 557). `heading` (3,) is a parabola; `beside` (n, 3) is what along, aside and heading have
    besides.
    """

    way: Array
    along: Array
    pull: Array
    heading: Array
    beside: Array

    @classmethod
    def of(cls, toss: Toss) -> Plain:
        """Fits a slide by least squares."""
        part = toss.pose[toss.slide]
        seconds = np.arange(len(part)) / RATE_HZ
        place, heading = part[:, :2] - part[0, :2], heading_of(part[:, 3:])
        way = place[-1] / max(float(np.linalg.norm(place[-1])), 1e-9)
        along, aside = place @ way, place @ np.array([-way[1], way[0]])
        speed = np.polynomial.Polynomial(_solved(_basis(seconds), along)).deriv()(seconds)
        turn = _solved(_basis(seconds), heading)
        pull = _pull(seconds, speed, np.polynomial.Polynomial(turn).deriv()(seconds))
        column = np.column_stack([np.ones_like(seconds), seconds, -pull])
        fit = _solved(column, along)
        beside = np.column_stack([along - column @ fit, aside, heading - _basis(seconds) @ turn])
        return cls(way, fit, pull, turn, beside)

    @property
    def level_m_s2(self) -> float:
        """The deceleration that the friction would give a block that does not turn."""
        return max(float(self.along[2]), _LEAST_M_S2)

    @property
    def seconds(self) -> Array:
        """The times of the frames (n,), s, from the slide's begin."""
        return np.arange(len(self.pull)) / RATE_HZ

    def shape(self) -> Array:
        """The place beside its plain way, in the unit level T², at `_SHARES` of the slide's time T."""
        return np.interp(_SHARES, self.seconds / self.seconds[-1], self.beside[:, 0]) / self._unit_m

    def without(self, common: Array) -> Array:
        """`beside` (n, 3), less what all have in common along their ways."""
        left = self.beside.copy()
        left[:, 0] -= self._unit_m * np.interp(self.seconds / self.seconds[-1], _SHARES, common)
        return left

    @property
    def _unit_m(self) -> float:
        return self.level_m_s2 * float(self.seconds[-1]) ** 2

    def slowed(self, count: int, ratio: float) -> tuple[Array, Array]:
        """Along (count,) and heading with friction `ratio` times as large: the same speeds, so much sooner."""
        sooner: Array = np.asarray(ratio * np.arange(count) / RATE_HZ, dtype=np.float64)
        column = np.column_stack([np.ones(count), sooner, -_extended(sooner, self.seconds, self.pull)])
        along = self.along[0] + (column[:, 1:] @ self.along[1:]) / ratio
        turned_by = _basis(sooner)[:, 1:] @ self.heading[1:] / ratio
        return along, turned_by


def _extended(at: Array, seconds: Array, values: Array) -> Array:
    """Interpolated; beyond the end by the last frames' parabola."""
    last = np.polyfit(seconds[-LEAST_FRAMES:], values[-LEAST_FRAMES:], 2)
    return np.where(at <= seconds[-1], np.interp(at, seconds, values), np.polyval(last, at))


def _pull(seconds: Array, speed: Array, rate: Array) -> Array:
    """∫∫ of the share of the friction that is against the sliding (n,)."""
    speed = np.maximum(speed, _LEAST_M_S)
    share = speed / np.hypot(speed, TURNING_RADIUS * CUBE_SIDE_M * rate)
    once = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(seconds) * (share[1:] + share[:-1]))])
    return np.concatenate([[0.0], np.cumsum(0.5 * np.diff(seconds) * (once[1:] + once[:-1]))])


def _basis(seconds: Array) -> Array:
    return np.column_stack([np.ones_like(seconds), seconds, seconds**2])


def _solved(table: Array, values: Array) -> Array:
    return np.asarray(np.linalg.lstsq(table, values, rcond=None)[0], dtype=np.float64)


def _slowed(toss: Toss, plain: Plain, ratio: float, common: Array, rng: np.random.Generator) -> Toss:
    """The slide with `ratio` times its friction, on a straight way, and signs drawn for what it has besides.

    It lasts until that brings it to rest; where that is longer, what it has besides is used again from its end on.
    Along, aside and turning get signs of their own: that a block which turns to the left swerves to the right is no
    constant friction's doing, nor that more of them swerve to one side.
    """
    part = toss.slide
    count = part.stop - part.start
    beside, heading = plain.without(common), heading_of(toss.pose[part, 3:])
    along, turned_by = plain.slowed(2 * round(count / ratio) + LEAST_FRAMES, ratio)
    new = max(int(along.argmax()), LEAST_FRAMES)  # until it stands
    along, turned_by = along[:new], turned_by[:new]
    source = np.arange(new) % (2 * count)
    source = np.where(source < count, source, 2 * count - 1 - source)
    signs = rng.choice([-1.0, 1.0], 3)
    drawn = signs * beside[source]
    frame = np.column_stack([plain.way, [-plain.way[1], plain.way[0]]])
    place = toss.pose[part.start, :2] + np.column_stack([along + drawn[:, 0], drawn[:, 1]]) @ frame.T
    base = toss.pose[part][source]
    wanted = plain.heading[0] + signs[2] * turned_by + drawn[:, 2]
    slid = np.column_stack([place, base[:, 2], turned(base[:, 3:], wanted - heading[source])])
    first, standing = toss.frame[part.start], toss.pose[min(part.stop + STANDING_FRAMES, len(toss.pose) - 1) :]
    rest = standing[np.arange(2 * STANDING_FRAMES) % len(standing)]
    rest[:, :2] += slid[-1, :2] - rest[0, :2]
    rest[:, 3:] = turned(rest[:, 3:], float(wanted[-1] - heading[-1]))
    before = toss.pose[: part.start].copy()
    before[:, 3:] = turned(before[:, 3:], float(wanted[0] - heading[0]))
    frames = [toss.frame[: part.start], first + np.arange(new), first + new + np.arange(len(rest))]
    pose = np.concatenate([before, slid, rest])
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
    """Writes a table that `station import cube-tosses` reads; the tosses are numbered in their order."""
    number = np.concatenate([np.full(len(toss.frame), place) for place, toss in enumerate(tosses)])
    pose = np.concatenate([toss.pose for toss in tosses])
    columns = {"toss": number, "frame": np.concatenate([toss.frame for toss in tosses])}
    columns |= dict(zip(POSE, pose.T, strict=True))
    pq.write_table(pa.table({name: pa.array(values) for name, values in columns.items()}), path)
    return path

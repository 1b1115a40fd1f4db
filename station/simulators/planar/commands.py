"""The commands of many runs: the plate's motion, the block's start pose, and its properties, without any effect."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from station.physics.contact import GRAVITY_M_S2, Array
from station.physics.reversals import last_sign, rising, turned_at
from station.rig.opening import Opening

STEADY_RAD_S = 2e-3
"""A plate that turns more slowly than this (0.1 °/s) is held."""
_SMOOTH_S = 0.03
ROUNDED_RAD = 1e-9
"""Two knots of a ramp whose tilts differ by less differ by rounding."""

Turns = tuple[Array, Array, Array]
"""A run's tilt between its knots: the direction, +1 or −1, and the tilt, rad, from which on it has gone so."""

_SHARED = ("border_m", "outline_m")


@dataclass(frozen=True, eq=False, kw_only=True)
class Commands:
    """n runs with k knots each; the plate's frame is P.

    Attributes:
        time_s: (n, k) ascending from row to row's own zero; a shorter run repeats its last knot.
        gravity: (n, k, 3) unit vector of gravity in P as the arm reports it; between knots along the great circle.
        rate_rad_s, acceleration_rad_s2: (n, k−1, 3) the plate's angular velocity and acceleration between two knots.
        pivot_m_s2: (n, k−1, 3) the acceleration in P of the point about which the plate turns, between two knots.
        rising: (n, k−1) the tilt's direction between two knots, +1 or −1; where it rests, its last one.
        turned_rad: (n, k−1) the tilt from which on it has gone in this direction; −inf before it has turned round.
        swing_rad: (n, k−1, 3) how far it had swung before, back and forth, see `station.physics.reversals`.
        start: (n, 3) x, y (m) and yaw (rad) of the block at the first knot.
        velocity: (n, 3) of the block at the first knot, m/s and rad/s; mostly 0: it lies there.
        rest_s: (n,) how long it had lain there by then, or before its slide.
        slid_s: (n,) how long it had slid by then; 0 if it lies or begins to slide.
        run: (n,) number of the run in its session, from 0.
        mass_kg, area_m2, mount_rad, temperature_c, relative_humidity: (n,) as in `Contact`.
        border_m: radius of the opening in the foam; inf without foam.
        outline_m: corners (x, y) of an opening that is not round; empty: it is.
    """

    time_s: Array
    gravity: Array
    rate_rad_s: Array
    acceleration_rad_s2: Array
    pivot_m_s2: Array
    rising: Array
    turned_rad: Array
    swing_rad: Array
    start: Array
    velocity: Array
    rest_s: Array
    slid_s: Array
    run: Array
    mass_kg: Array
    area_m2: Array
    mount_rad: Array
    temperature_c: Array
    relative_humidity: Array
    border_m: float = float("inf")
    outline_m: tuple[tuple[float, float], ...] = ()

    def __len__(self) -> int:
        return len(self.time_s)

    @property
    def opening(self) -> Opening:
        """The opening in the foam."""
        return Opening(radius_m=self.border_m, outline_m=self.outline_m)

    @property
    def end_s(self) -> Array:
        """The end (n,), s, of each run."""
        return self.time_s[:, -1]

    @property
    def rest_from_s(self) -> Array:
        """The time (n,), s, at which each block came to rest: before the first knot, or before its slide there."""
        return self.time_s[:, 0] - self.slid_s - self.rest_s

    @property
    def tilt_rad(self) -> Array:
        """The reported tilt at the knots (n, k)."""
        return tilt_of(self.gravity)

    def rows(self, chosen: slice) -> Commands:
        """Returns the chosen runs, as views."""
        own = {spec.name: getattr(self, spec.name)[chosen] for spec in fields(self) if spec.name not in _SHARED}
        return replace(self, **own)

    def tilt_at(self, time_s: Array) -> Array:
        """Returns the reported tilt (n,), rad, of each run at a time of its own, `time_s` (n,), s; nan stays nan."""
        return tilt_of(self._gravity_at(time_s, self._left(time_s)))

    def resting_tilt_at(self, time_s: Array) -> Array:
        """Returns the tilt (n,), rad, at which a plate at rest loads each block as the turning one at `time_s` (n,), s.

        The block lies at its start. An onset is told so, for the friction is that tilt's tangent.
        """
        left, row = self._left(time_s), np.arange(len(self))
        position = np.column_stack([self.start[:, :2], np.zeros(len(self))])
        rate, faster = self.rate_rad_s[row, left], self.acceleration_rad_s2[row, left]
        turning = np.cross(faster, position) + np.cross(rate, np.cross(rate, position))
        return tilt_of(GRAVITY_M_S2 * self._gravity_at(time_s, left) - turning)

    def _left(self, time_s: Array) -> NDArray[np.intp]:
        """Returns the knot (n,) before each run's time (n,)."""
        return np.clip((self.time_s <= time_s[:, None]).sum(axis=1) - 1, 0, self.time_s.shape[1] - 2)

    def _gravity_at(self, time_s: Array, left: NDArray[np.intp]) -> Array:
        """Returns the reported direction of gravity (n, 3), between the knots `left` (n,) and the next ones."""
        row = np.arange(len(self))
        begin, end = self.time_s[row, left], self.time_s[row, left + 1]
        share = np.clip((time_s - begin) / np.maximum(end - begin, 1e-12), 0.0, 1.0)[:, None]
        first, last = self.gravity[row, left], self.gravity[row, left + 1]
        angle = np.arctan2(np.linalg.norm(np.cross(first, last), axis=1), np.sum(first * last, axis=1))[:, None]
        small = angle < 1e-9
        sine = np.where(small, 1.0, np.sin(angle))
        near = np.where(small, 1.0 - share, np.sin((1.0 - share) * angle) / sine)
        far = np.where(small, share, np.sin(share * angle) / sine)
        return near * first + far * last


def tilt_of(gravity: Array) -> Array:
    """Returns the angle (…,), rad, between the plate's normal and up from `gravity` (…, 3) in P, of any length."""
    return np.arctan2(np.hypot(gravity[..., 0], gravity[..., 1]), -gravity[..., 2])


def ramps(
    time_s: ArrayLike,
    angle_rad: ArrayLike,
    *,
    downhill_rad: ArrayLike = 0.0,
    border_m: float = float("inf"),
    outline_m: tuple[tuple[float, float], ...] = (),
    **circumstances: ArrayLike,
) -> Commands:
    """Runs of straight ramps between knots, each about one fixed axis; the plate's acceleration is left out.

    Args:
        time_s: (k,) or (n, k) knots.
        angle_rad: (k,) or (n, k) tilt at the knots; a negative one slopes the other way.
        downhill_rad: () or (n,) direction in P that a positive tilt slopes down to.
        border_m: as in `Commands`.
        outline_m: as in `Commands`.
        circumstances: fields of `Commands` with one value a run, or one for all; what is left out keeps a usual value.
    """
    times, angles = (np.atleast_2d(np.asarray(values, dtype=float)) for values in (time_s, angle_rad))
    downhill = np.atleast_1d(np.asarray(downhill_rad, dtype=float))
    first = [len(np.atleast_1d(np.asarray(values))) for values in circumstances.values()]
    n = max(len(times), len(angles), len(downhill), *first, 1)
    times, angles = (np.broadcast_to(values, (n, times.shape[1])).copy() for values in (times, angles))
    down = np.broadcast_to(downhill, (n,))
    cosine, sine = np.cos(down)[:, None], np.sin(down)[:, None]
    gravity = np.stack([np.sin(angles) * cosine, np.sin(angles) * sine, -np.cos(angles)], axis=-1)
    pace = np.diff(angles, axis=1) / np.maximum(np.diff(times, axis=1), 1e-12)
    rate = np.stack([-pace * sine, pace * cosine, np.zeros_like(pace)], axis=-1)
    signs, turned, swing = _turns([_as_ramps(own) for own in np.abs(angles)])
    return Commands(
        time_s=times,
        gravity=gravity,
        rate_rad_s=rate,
        acceleration_rad_s2=np.zeros_like(rate),
        pivot_m_s2=np.zeros_like(rate),
        rising=signs,
        turned_rad=turned,
        swing_rad=swing,
        border_m=border_m,
        outline_m=outline_m,
        **_circumstances(n, circumstances),
    )


def tracks(
    time_s: Sequence[Array],
    gravity: Sequence[Array],
    *,
    pivot_m_s2: Sequence[Array] | None = None,
    turns: Sequence[Turns] | None = None,
    border_m: float = float("inf"),
    outline_m: tuple[tuple[float, float], ...] = (),
    **circumstances: ArrayLike,
) -> Commands:
    """Runs of recorded attitudes, finely sampled: times (k_i,) and unit vectors of gravity in P (k_i, 3) of each run.

    The pivot's accelerations in P (k_i − 1, 3), m/s², are those between the knots; without any the pivot rests.
    `turns` are the tilt's directions and turns between the knots, two (k_i − 1,) of each run, as in `Commands`; without
    any they are read from the attitudes, and what the tilt did before the first knot is not known.

    Rates are those along the great circles (a turn about gravity itself moves nothing that matters here), and
    accelerations their differences over 60 ms.

    Raises:
        ValueError: unless every run has at least two knots.
    """
    if any(len(times) < 2 for times in time_s):
        raise ValueError("expected at least two knots in every run")
    k = max(len(times) for times in time_s)
    times = np.stack([_padded(np.asarray(values, dtype=float), k) for values in time_s])
    down = np.stack([_padded(np.asarray(values, dtype=float), k) for values in gravity])
    down /= np.linalg.norm(down, axis=-1, keepdims=True)
    lengths = np.diff(times, axis=1)[..., None]
    rate = np.where(lengths > 0, np.cross(down[:, 1:], down[:, :-1]) / np.where(lengths > 0, lengths, 1.0), 0.0)
    if turns is None:
        turns = [_as_read(own, tilt_of(along)) for own, along in zip(times, down, strict=True)]
    signs, turned, swing = _turns(turns)
    return Commands(
        time_s=times,
        gravity=down,
        rate_rad_s=rate,
        acceleration_rad_s2=_accelerations(times, rate),
        pivot_m_s2=np.zeros_like(rate) if pivot_m_s2 is None else np.stack([_padded(own, k - 1) for own in pivot_m_s2]),
        rising=signs,
        turned_rad=turned,
        swing_rad=swing,
        border_m=border_m,
        outline_m=outline_m,
        **_circumstances(len(times), circumstances),
    )


def _turns(each: Sequence[Turns]) -> Turns:
    """Returns the tilt's directions, turns and swings of all runs (n, k−1), the last of a shorter run repeated."""
    most = max(len(signs) for signs, *_ in each)
    signs, turned, swing = (np.stack([_padded(own, most) for own in column]) for column in zip(*each, strict=True))
    return signs, turned, swing


def _as_ramps(tilt_rad: Array) -> Turns:
    """Returns the turns of straight ramps between knots (k,)."""
    signs = last_sign(np.diff(tilt_rad), ROUNDED_RAD)
    return signs, *turned_at(tilt_rad[:-1], signs, before_rad=-np.inf)


def _as_read(time_s: Array, tilt_rad: Array) -> Turns:
    """Returns the turns of recorded tilts (k,)."""
    signs = rising(time_s, tilt_rad, 0.5 * (time_s[1:] + time_s[:-1]))
    return signs, *turned_at(tilt_rad[:-1], signs, before_rad=-np.inf)


def _padded(values: Array, k: int) -> Array:
    return np.concatenate([values, np.repeat(values[-1:], k - len(values), axis=0)])


def _accelerations(time_s: Array, rate: Array) -> Array:
    """Returns differences of the rates over some 60 ms (n, k−1, 3): over one knot they would be mostly noise."""
    middle = 0.5 * (time_s[:, 1:] + time_s[:, :-1])
    step = float(np.median(np.diff(time_s, axis=1)[np.diff(time_s, axis=1) > 0]))
    reach = max(1, round(_SMOOTH_S / step))
    count = middle.shape[1]
    before, after = np.maximum(np.arange(count) - reach, 0), np.minimum(np.arange(count) + reach, count - 1)
    apart = (middle[:, after] - middle[:, before])[..., None]
    return np.where(apart > 0, (rate[:, after] - rate[:, before]) / np.where(apart > 0, apart, 1.0), 0.0)


_USUAL = {
    "rest_s": 10.0,
    "slid_s": 0.0,
    "mass_kg": 0.00785,
    "area_m2": 1e-4,
    "mount_rad": 0.0,
    "temperature_c": float("nan"),
    "relative_humidity": float("nan"),
}


def _circumstances(n: int, given: dict[str, ArrayLike]) -> dict[str, Array]:
    unknown = sorted(set(given) - {*_USUAL, "run", "start", "velocity"})
    if unknown:
        raise TypeError(f"unknown circumstances of a run: {', '.join(unknown)}")
    values = {name: np.full(n, usual) for name, usual in _USUAL.items()}
    values |= {"run": np.arange(n, dtype=float), "start": np.zeros((n, 3)), "velocity": np.zeros((n, 3))}
    for name, value in given.items():
        values[name] = np.array(np.broadcast_to(np.asarray(value, dtype=float), values[name].shape))
    return values

"""The turning of a sliding block, and the friction that turning and sliding share.

On an ellipsoidal limit surface (Howe & Cutkosky 1996, IJRR 15, 557) a block that slides at v and turns at ω meets, with
D = √(v² + ρ²ω²) and the friction h N against sliding alone,

    a force h N v / D against its way,    a moment h N ρ² ω / D per mass,    k² ω′ = k² spin − h N ρ² ω / D,

ρ = L / √12 (`station.physics.sole`), k² = L²/6 the square radius of gyration. At low speed ω relaxes faster than any
step, to where drive and friction balance: ρ ω / v = q / √(1 − q²), q the drive over the largest moment of friction.
Above that ω is integrated by an exponential Kutta rule of the third order (Cox & Matthews 2002, J. Comput. Phys. 176,
430), whose stages are those of the slide's own rule.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from station.physics.contact import Array, Bools
from station.physics.sole import SQUARE_GYRATION, TURNING_RADIUS

_BOUND_M_S = 1e-3
"""The least D, m/s, at which ω is integrated: below it drive and friction balance."""
_MOST = 0.98
"""The largest q for which there is such a balance."""
_SMALL = 0.02


class Turning(NamedTuple):
    """One stage of a step (a,): the share v / D of friction that is against the sliding, the yaw rate, and its change.

    The change is `drive` − `decay` · `rate`; where the rate is `bound` it is what balances the two instead.
    """

    share: Array
    rate: Array
    drive: Array
    decay: Array
    bound: Bools


def turning(spin: Array, *, hold: Array, speed: Array, rate: Array, side: Array, bound: Bools | None) -> Turning:
    """Computes a stage of the turning of blocks (a,).

    Args:
        spin: (a,) the drive, rad/s².
        hold: (a,) the friction per mass against sliding alone, m/s².
        speed: (a,) m/s.
        rate: (a,) the yaw rate, rad/s.
        side: (a,) the side of the sole, m.
        bound: (a,) that of the step's first stage; None: this is it.
    """
    reach = TURNING_RADIUS * side
    strongest = hold * reach / (SQUARE_GYRATION * side * side)
    together = np.maximum(np.sqrt(speed * speed + np.square(reach * rate)), 1e-9)
    q = spin / np.maximum(strongest, 1e-12)
    if bound is None:
        bound = (together < _BOUND_M_S) & (np.abs(q) < _MOST)
    share, decay = speed / together, strongest * reach / together
    slow = np.flatnonzero(bound | (together <= 1e-9))
    if len(slow):
        q = np.clip(q[slow], -_MOST, _MOST)
        share[slow] = root = np.sqrt(1.0 - q * q)
        rate = rate.copy()
        rate[slow] = np.where(bound[slow], q * speed[slow] / (reach[slow] * root), rate[slow])
    return Turning(share, rate, spin, decay, bound)


class Decays(NamedTuple):
    """The decay of the first stage over a step (a,): z = −decay · step, half of it and whole.

    `kept` is eᶻ, `share` (eᶻ − 1) / z; `begin`, `middle`, `end` are the weights of the stages (1/6, 4/6, 1/6 at z = 0).
    """

    step: Array
    kept_half: Array
    share_half: Array
    kept: Array
    share: Array
    begin: Array
    middle: Array
    end: Array


def decays(first: Turning, step: Array) -> Decays:
    """Returns the `Decays` of `step` (a,), s.

    Where z is small, and the fractions would cancel, they are Taylor series.
    """
    z = np.minimum(-first.decay * step, -1e-12)
    small = z > -_SMALL
    w = np.where(small, -1.0, z)
    inverse = 1.0 / w
    kept_half = np.exp(0.5 * w)
    kept = kept_half * kept_half
    share, share_half = (kept - 1.0) * inverse, 2.0 * (kept_half - 1.0) * inverse
    # (share − 1) / z and so on, each of which is another order of the same remainder.
    second = (share - 1.0) * inverse
    third = (second - 0.5) * inverse
    begin, middle, end = share - 3.0 * second + 4.0 * third, 4.0 * second - 8.0 * third, 4.0 * third - second
    parts = (kept_half, share_half, kept, share, begin, middle, end)
    if small.any():
        series = _series(z)
        parts = tuple(np.where(small, near, far) for near, far in zip(series, parts, strict=True))
    return Decays(step, *parts)


def _series(z: Array) -> tuple[Array, ...]:
    kept_half, kept = 1.0 + z * (0.5 + z * (0.125 + z / 48.0)), 1.0 + z * (1.0 + z * (0.5 + z / 6.0))
    share_half, share = 1.0 + z * (0.25 + z / 24.0), 1.0 + z * (0.5 + z / 6.0)
    begin, middle = 1 / 6 + z * (1 / 6 + z * 3 / 40), 2 / 3 + z * (1 / 3 + z / 10)
    return kept_half, share_half, kept, share, begin, middle, 1 / 6 - z * z / 120


def rate_at_half(first: Turning, way: Decays) -> Array:
    """Returns the yaw rate (a,) for the second stage, half a step on."""
    return first.rate * way.kept_half + 0.5 * way.step * way.share_half * first.drive


def rate_at_full(first: Turning, second: Turning, way: Decays) -> Array:
    """Returns the yaw rate (a,) for the third stage, a step on."""
    drive = 2.0 * _beside(second, first) - first.drive
    return first.rate * way.kept + way.step * way.share * drive


def rate_after(first: Turning, second: Turning, third: Turning, way: Decays) -> tuple[Array, Array]:
    """Returns the yaw rate (a,) after a step, and how far a rule of lower order is from it."""
    inner, last = _beside(second, first), _beside(third, first)
    # The two rules differ only in what follows from the stages.
    off = way.begin * first.drive + (way.middle - way.share) * inner + way.end * last
    rate = first.rate * way.kept + way.step * (off + way.share * inner)
    off = np.abs(way.step * off)
    if not first.bound.any():
        return rate, off
    return np.where(first.bound, third.rate, rate), np.where(first.bound, 0.0, off)


def _beside(stage: Turning, first: Turning) -> Array:
    """Returns the part of a stage's change besides the decay of the first stage."""
    return stage.drive + (first.decay - stage.decay) * stage.rate

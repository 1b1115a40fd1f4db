"""Maximum dissipation: onset, first direction and sideways force of any convex limit curve.

With the support function h(φ) the block slips when max over φ of (T·e(φ) − N h(φ)) passes zero, in the direction of
that maximum, and slides in φ against N (h e_r + h′ e_φ) (Goyal, Ruina, Papadopoulos 1991).

Some friction differs by the direction and yet opposes the motion alone: of bristles that are bent by it, or of a sole
that presses more in front. With the curve s that steers (`Effect.steering`), h itself by maximum dissipation, the force
across the way is N h (ln s)′ in general. The load is then balanced in the direction of the least s(φ) / cos(φ − load).
"""

from __future__ import annotations

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.model import Model
from station.physics.narrowing import Bracket

STEP_RAD = 0.01
"""The step of the central differences of h; their error is h''' / 60 000, far below any scatter."""

_TURNS = (-STEP_RAD, 0.0, STEP_RAD)
_STEPS = 20
_SETTLED_RAD = 1e-4
_FARTHEST_RAD = 1.5


def support(model: Model, contact: Contact, way_rad: Array) -> tuple[Array, Array, Array]:
    """Returns the friction h (n,) against slides along `way_rad` (n,), rad in P, relative to N.

    It also returns the force across and its derivative, relative to N as well.

    By maximum dissipation they are the support function, h′ and h″.
    """
    curve, slope, bend = _steered(model, contact, way_rad)
    if model.is_dissipative:
        return curve, slope, bend
    ways = (contact.facing(way_rad + turn) for turn in _TURNS)
    before, more, after = (model.friction(each) / model.steering(each) for each in ways)
    return more * curve, more * slope, more * bend + slope * (after - before) / (2 * STEP_RAD)


def support_slope(model: Model, contact: Contact, way_rad: Array) -> Array:
    """Gives the force across the directions `way_rad` (n,), rad in P, relative to N: h′ (n,) by maximum dissipation."""
    behind, ahead = (contact.facing(way_rad + turn) for turn in (-STEP_RAD, STEP_RAD))
    slope = (model.steering(ahead) - model.steering(behind)) / (2 * STEP_RAD)
    if model.is_dissipative:
        return slope
    here = contact.facing(way_rad)
    return slope * model.friction(here) / model.steering(here)


def _steered(model: Model, contact: Contact, way_rad: Array) -> tuple[Array, Array, Array]:
    """Returns the curve that steers (n,), and its two derivatives."""
    behind, here, ahead = (model.steering(contact.facing(way_rad + turn)) for turn in _TURNS)
    return here, (ahead - behind) / (2 * STEP_RAD), (ahead - 2 * here + behind) / STEP_RAD**2


def threshold(model: Model, contact: Contact, load_rad: Array) -> tuple[Array, Array]:
    """Returns the largest T/N (n,) that holds against a load in direction `load_rad`, and the slip's direction (n,).

    The direction is the minimum over φ of s(φ) / cos(φ − load), found by Newton's method in a bracket from the load's
    own direction; an isotropic model needs no search.
    """
    here, slope, bend = _steered(model, contact, load_rad)
    best, best_way = here, load_rad.copy()
    if np.any(np.abs(slope) > 1e-9):
        bracket = Bracket.around(len(here), _FARTHEST_RAD)
        for _ in range(_STEPS):
            bracket = bracket.narrowed(*_rise(bracket.at, (here, slope, bend)))
            here, slope, bend = _steered(model, contact, load_rad + bracket.at)
            held = here / np.cos(bracket.at)
            better = held < best
            best, best_way = np.where(better, held, best), np.where(better, load_rad + bracket.at, best_way)
            if bracket.settled(_SETTLED_RAD):
                break
    return best if model.is_dissipative else held_along(model, contact, load_rad, best_way), best_way


def held_along(model: Model, contact: Contact, load_rad: Array, way_rad: Array) -> Array:
    """Returns the ratio T/N (n,) that holds against a load a block that can only slide along one way.

    Along the direction in which another model's block slips it is the threshold of a model near that one, to first
    order in their difference: by maximum dissipation the threshold is a minimum over the directions, and never above
    it. Of friction that opposes the motion alone a fortieth of that order is missed where an effect is a tenth.

    Args:
        model: the model that holds.
        contact: the blocks.
        load_rad: (n,) the direction of the load, rad in P.
        way_rad: (n,) the way, rad in P.
    """
    return model.friction(contact.facing(way_rad)) / np.cos(way_rad - load_rad)


def _rise(off: Array, curve: tuple[Array, Array, Array]) -> tuple[Array, Array]:
    """Returns the first and second derivative (n,) of ln (s / cos) by the offset (n,) from the load's direction.

    In u = tan(off) the function is convex for any convex curve: it has one minimum, also where the curve has a corner
    or a straight part.
    """
    here, slope, bend = curve
    first = slope / here + np.tan(off)
    return first, bend / here - (slope / here) ** 2 + 1.0 / np.cos(off) ** 2

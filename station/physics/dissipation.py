"""Maximum dissipation: onset, first direction and sideways force of any convex limit curve.

With the support function h(φ) the block slips when max over φ of (T·e(φ) − N h(φ)) passes zero, in the direction of
that maximum, and slides in φ against N (h e_r + h′ e_φ) (Goyal, Ruina, Papadopoulos 1991).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.model import Model
from station.physics.narrowing import Bracket

STEP_RAD = 0.01
"""The step of the central differences of h; their error is h''' / 60 000, far below any scatter."""

_STEPS = 20
_SETTLED_RAD = 1e-4
_FARTHEST_RAD = 1.5


def support(model: Model, contact: Contact, way_rad: Array) -> tuple[Array, Array, Array]:
    """The support function h, h′ and h″ (n,) of the limit curve in directions (n,), relative to the normal force."""
    ahead = model.friction(replace(contact, way_rad=way_rad + STEP_RAD))
    here = model.friction(replace(contact, way_rad=way_rad))
    behind = model.friction(replace(contact, way_rad=way_rad - STEP_RAD))
    return here, (ahead - behind) / (2 * STEP_RAD), (ahead - 2 * here + behind) / STEP_RAD**2


def support_slope(model: Model, contact: Contact, way_rad: Array) -> Array:
    """The derivative h′ (n,) of the support function in directions (n,)."""
    ahead = model.friction(replace(contact, way_rad=way_rad + STEP_RAD))
    behind = model.friction(replace(contact, way_rad=way_rad - STEP_RAD))
    return (ahead - behind) / (2 * STEP_RAD)


def threshold(model: Model, contact: Contact, load_rad: Array) -> tuple[Array, Array]:
    """The largest ratio T/N (n,) that holds against a load in direction `load_rad`, and the direction (n,) of the slip.

    It is the minimum over φ of h(φ) / cos(φ − load), found by Newton's method in a bracket from the load's own
    direction; an isotropic model needs no search.
    """
    here, slope, bend = support(model, contact, load_rad)
    best, best_way = here, load_rad.copy()
    if not np.any(np.abs(slope) > 1e-9):
        return best, best_way
    bracket = Bracket.around(len(here), _FARTHEST_RAD)
    for _ in range(_STEPS):
        bracket = bracket.narrowed(*_rise(bracket.at, (here, slope, bend)))
        here, slope, bend = support(model, contact, load_rad + bracket.at)
        held = here / np.cos(bracket.at)
        better = held < best
        best, best_way = np.where(better, held, best), np.where(better, load_rad + bracket.at, best_way)
        if bracket.settled(_SETTLED_RAD):
            break
    return best, best_way


def held_along(model: Model, contact: Contact, load_rad: Array, way_rad: Array) -> Array:
    """The ratio T/N (n,) that holds against a load in direction `load_rad` a block that can only slide along `way_rad`.

    It is never below the threshold. Along the direction in which another model's block slips it is the threshold of a
    model near that one, to first order in their difference: the threshold is a minimum over the directions.
    """
    return model.friction(replace(contact, way_rad=way_rad)) / np.cos(way_rad - load_rad)


def _rise(off: Array, curve: tuple[Array, Array, Array]) -> tuple[Array, Array]:
    """The first and second derivative (n,) of ln (h / cos) by the offset (n,) from the load's direction.

    In u = tan(off) the function is convex for any convex curve: it has one minimum, also where the curve has a corner
    or a straight part.
    """
    here, slope, bend = curve
    first = slope / here + np.tan(off)
    return first, bend / here - (slope / here) ** 2 + 1.0 / np.cos(off) ** 2

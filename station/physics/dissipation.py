"""Maximum dissipation: onset, first direction and sideways force of any convex limit curve.

With the support function h(φ) the block slips when max over φ of (T·e(φ) − N h(φ)) passes zero, in the direction of
that maximum, and slides in φ against N (h e_r + h′ e_φ) (Goyal, Ruina, Papadopoulos 1991).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.model import Model

STEP_RAD = 0.02
"""Of the central differences of h: their error is h''' / 15 000, far below any scatter."""

_NEWTON_STEPS = 6
_FARTHEST_RAD = 1.2


def support(model: Model, contact: Contact, way_rad: Array) -> tuple[Array, Array, Array]:
    """h, h′ and h″ (n,) of the limit curve in a direction, in units of the normal force."""
    ahead = model.friction(replace(contact, way_rad=way_rad + STEP_RAD))
    here = model.friction(replace(contact, way_rad=way_rad))
    behind = model.friction(replace(contact, way_rad=way_rad - STEP_RAD))
    return here, (ahead - behind) / (2 * STEP_RAD), (ahead - 2 * here + behind) / STEP_RAD**2


def threshold(model: Model, contact: Contact, load_rad: Array) -> tuple[Array, Array]:
    """The ratio T/N (n,) that a resting block holds against a load in a direction, and the way (n,) it then takes.

    The smallest over φ of h(φ) / cos(φ − load), by Newton's method from the load's own direction; a model without
    directions needs none of it.
    """
    here, slope, bend = support(model, contact, load_rad)
    way = load_rad.copy()
    if not np.any(np.abs(slope) > 1e-9):
        return here, way
    best, best_way = here, way
    for _ in range(_NEWTON_STEPS):
        # d/dφ of ln h − ln cos(φ − load): h′/h + tan = 0.
        off = way - load_rad
        first = slope / here + np.tan(off)
        second = bend / here - (slope / here) ** 2 + 1.0 / np.cos(off) ** 2
        step = -first / np.maximum(second, 0.2)
        way = load_rad + np.clip(off + np.clip(step, -0.4, 0.4), -_FARTHEST_RAD, _FARTHEST_RAD)
        here, slope, bend = support(model, contact, way)
        held = here / np.cos(way - load_rad)
        better = held < best
        best, best_way = np.where(better, held, best), np.where(better, way, best_way)
    return best, best_way

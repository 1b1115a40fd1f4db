"""The forces on a block on a moving plate: the one place in the evidence that has a block's equation of motion.

Newton's second law in the plate's frame P, per mass, for a block at r from the pivot with velocity v on the plate:

    r'' = g - A - α x r - ω x (ω x r) - 2 ω x v + contact,

with the pivot's acceleration A, the plate's rate ω and angular acceleration α. Along the plate the sum is the pull, and
minus its part along the normal is the press (Goldstein, Classical Mechanics, section 4.10).
"""

from __future__ import annotations

import numpy as np

from shared.vectors import cross
from station.diagnosis.observations.plate import Attitude
from station.physics.contact import GRAVITY_M_S2, Array
from station.physics.turning import turned_push


def driving(plate: Attitude, place_m: Array, velocity_m_s: Array) -> Array:
    """Returns the acceleration (n, 3), m/s² in P, without the contact.

    Args:
        plate: the plate's attitude and motion at the same n moments.
        place_m: (n, 2) the blocks' places in P, m.
        velocity_m_s: (n, 2) their velocities in P, m/s.
    """
    return GRAVITY_M_S2 * plate.gravity + fictitious(plate, place_m, velocity_m_s)


def fictitious(plate: Attitude, place_m: Array, velocity_m_s: Array) -> Array:
    """Returns the part of `driving` that the plate's own motion causes (n, 3), m/s² in P; 0 on a plate at rest.

    Args:
        plate: the plate's attitude and motion at the same n moments.
        place_m: (n, 2) the blocks' places in P, m.
        velocity_m_s: (n, 2) their velocities in P, m/s.
    """
    rate, position, velocity = plate.rate_rad_s, _flat(place_m), _flat(velocity_m_s)
    turned = turned_push(plate.acceleration_rad_s2, rate, position)
    return turned - plate.pivot_m_s2 - 2.0 * cross(rate, velocity)


def _flat(vectors: Array) -> Array:
    """Returns vectors (n, 2) in the plate as vectors (n, 3)."""
    return np.column_stack([vectors, np.zeros(len(vectors))])

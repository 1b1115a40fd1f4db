"""What moves a block on a plate that moves: the one place in the evidence where a block's equation of motion stands.

Newton's second law in the plate's frame P, per mass, for a block at r from the pivot with velocity v on the plate:

    r'' = g - A - α x r - ω x (ω x r) - 2 ω x v + contact,

with the pivot's acceleration A, the plate's rate ω and angular acceleration α. Along the plate the sum is the pull, and
minus its part along the normal is what presses the block on (Goldstein, Classical Mechanics, section 4.10).
"""

from __future__ import annotations

import numpy as np

from station.diagnosis.observations.plate import Attitude
from station.physics.contact import GRAVITY_M_S2, Array


def driving(plate: Attitude, place_m: Array, velocity_m_s: Array) -> Array:
    """Acceleration (n, 3), m/s² in P, of what no contact holds at places (n, 2) with velocities (n, 2) in P."""
    return GRAVITY_M_S2 * plate.gravity + fictitious(plate, place_m, velocity_m_s)


def fictitious(plate: Attitude, place_m: Array, velocity_m_s: Array) -> Array:
    """The part of `driving` that comes of the plate's own motion (n, 3): nothing on a plate at rest."""
    rate, place, velocity = plate.rate_rad_s, _flat(place_m), _flat(velocity_m_s)
    turning = np.cross(plate.acceleration_rad_s2, place) + np.cross(rate, np.cross(rate, place))
    return -(plate.pivot_m_s2 + turning + 2.0 * np.cross(rate, velocity))


def _flat(vectors: Array) -> Array:
    """Vectors (n, 2) in the plate as vectors (n, 3)."""
    return np.column_stack([vectors, np.zeros(len(vectors))])

"""Vectors as a plate sees them that stands turned from where it is reported."""

from __future__ import annotations

import numpy as np

from shared.vectors import cross
from station.physics.contact import Array


def seen_turned(vector: Array, turn: Array) -> Array:
    """Returns vectors in P as a plate sees them that is turned on, in the shape of `vector`.

    R_true = R exp[r×], so that what is v in the reported plate is exp[−r×] v in the true one (Rodrigues' formula).

    Args:
        vector: (…, 3) the vectors in P, in any unit.
        turn: (…, 3) rotation vectors by which the plate is turned on, rad, in P.
    """
    angle = np.linalg.norm(turn, axis=-1, keepdims=True)
    axis = turn / np.where(angle > 0, angle, 1.0)
    along = np.sum(axis * vector, axis=-1, keepdims=True)
    return vector * np.cos(angle) - cross(axis, vector) * np.sin(angle) + axis * along * (1.0 - np.cos(angle))

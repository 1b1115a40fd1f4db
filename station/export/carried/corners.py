"""Turns a box on its four corners as easily out of its rest as a block on an even sole.

The limit of friction beside a small moment M about the mass is F² + M² / R² = (mu N)², R² the mean square of the arms
across the load: L² / 12 for an even sole of the width L, L² / 4 − s² for four corners at L / 2. Those in front carry
more: the pressure's centre leads by s, the mass's height times load over normal force. With a moment that is larger by
the ratio of both R the corners let go where the sole does. Once the block slides, corners resist turning by the square
of that ratio, so that it turns less than on an even sole, by the ratio, in place of its square.
"""

from __future__ import annotations

import math

from station.physics.sole import TURNING_RADIUS


def stronger(leading_m: float, *, side_m: float) -> float:
    """Returns the factor on a moment with which corners let go where an even sole does; `leading_m` is s."""
    return math.sqrt(max(0.25 * side_m**2 - leading_m**2, 0.0)) / (TURNING_RADIUS * side_m)

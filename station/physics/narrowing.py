"""Newton's method in a bracket, for many numbers at once."""

from __future__ import annotations

import numpy as np

from station.physics.contact import Array

_LEAST_SLOPE = 1e-3


def narrowed(at: Array, low: Array, high: Array, value: Array, slope: Array) -> tuple[Array, Array, Array]:
    """A narrower bracket (n,), (n,) of where a rising function vanishes, and the place (n,) to look next.

    `value` and `slope` are the function's at `at`: its sign says on which side of it the zero lies, also where Newton's
    step is worthless; the next place is Newton's if that is inside the bracket, else its middle.
    """
    low, high = np.where(value < 0, at, low), np.where(value < 0, high, at)
    newton = at - value / np.where(slope > _LEAST_SLOPE, slope, np.nan)
    inside = (newton >= low) & (newton <= high)
    return low, high, np.where(inside, newton, 0.5 * (low + high))

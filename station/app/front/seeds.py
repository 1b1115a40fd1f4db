"""The seeds of random choices that Python's users give."""

from __future__ import annotations

import numpy as np

from shared.errors import UserError


def seed_of(seed: object) -> int:
    """Returns the seed of random choices that was given.

    Raises:
        UserError: for what is none.
    """
    if not isinstance(seed, int | np.integer) or isinstance(seed, bool) or seed < 0:
        raise UserError(f"Expected seed to be a whole number of 0 or more, got {seed!r}")
    return int(seed)

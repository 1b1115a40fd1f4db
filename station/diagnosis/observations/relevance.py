"""A regression whose groups of coefficients have variances of their own, which the data tell: most of them are nothing.

Thirteen waves fitted to the directions of a hundred slides are off by a third of a direction's error, together for all
slides alike, and a law was found in it. Automatic relevance determination (Tipping 2001, J. Mach. Learn. Res. 1, 211;
the steps are those of MacKay 1992, Neural Comput. 4, 415) keeps what the data ask for, hardly smaller, and takes the
rest for the noise that it is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from station.physics.contact import Array

ROUNDS = 200
"""The steps until the variances stand still (`pytest tests/unit/diagnosis/test_relevance.py -k likeliest`)."""
IRRELEVANT = 1e8
"""A precision beyond this multiple of what the data say of a coefficient holds it at zero, and one below this part of
that leaves it free. A smaller one is lost in rounding where columns are the same, as of a block that never turns, and
the coefficients run away (`pytest tests/unit/diagnosis/test_relevance.py -k same`)."""


def relevant(design: Array, values: Array, weight: Array, group: NDArray[np.int64]) -> Array:
    """Returns the expected coefficients (k,) of `values` (n,) by the columns of `design` (n, k).

    The coefficients of a group are drawn from one normal distribution about 0, whose variance is the likeliest.

    Args:
        design: (n, k) the columns.
        values: (n,) what they explain.
        weight: (n,) the inverse variances of the values' errors.
        group: (k,) the number of each column's group, from 0.
    """
    known = (design * weight[:, None]).T @ design
    moment = design.T @ (weight * values)
    sizes = np.bincount(group)
    most = IRRELEVANT * max(float(np.diag(known).max(initial=0.0)), 1e-300)
    least = np.maximum(np.bincount(group, np.diag(known)) / sizes / IRRELEVANT, 1e-300)
    precision = np.full(len(sizes), most / IRRELEVANT**2)
    found = np.zeros(len(moment))
    for _ in range(ROUNDS):
        spread = np.linalg.inv(known + np.diag(precision[group]))
        found = spread @ moment
        left = precision * np.bincount(group, np.diag(spread))
        precision = np.clip((sizes - left) / np.maximum(np.bincount(group, found**2), 1e-300), least, most)
    return found

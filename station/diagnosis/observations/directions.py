"""The directions in which blocks slide, relative to the steepest line, without the noise of their measurement.

A law of the direction must not be fitted to the noise of directions: they are replaced by their expectation given the
measurement (regression calibration; Carroll et al. 2006, Measurement Error in Nonlinear Models, chapter 4). They are
shrunk toward what similar runs share: a level error or a texture turns all of them. Shrinkage toward the steepest line
itself would make every such turn a tenth too small. What they share is an expectation, too: see `relevance`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from station.diagnosis.observations.plate import Times
from station.diagnosis.observations.relevance import relevant
from station.physics.contact import Array

HARMONICS = (1, 2, 3, 4, 6)
"""The orders to which a law's turns are followed: a grain of two axes that is pinched, and of three and four axes."""
FAR = 0.98
"""Deviations beyond this quantile are clipped to it: a block that was knocked follows no law."""

KEPT = float(chi2.cdf(chi2.ppf(FAR, 1), 3) + chi2.ppf(FAR, 1) * (1.0 - FAR))
"""The share of a Gaussian's variance that is left when its squares are clipped at their quantile FAR."""

LEAST_RAD = 1e-5
"""A guard of a division. Whole paths tell directions to .1 to .5 mrad: by a floor of 1 mrad, a block that is carried
aside by its turning had a constant way along its slide, and a one-way friction stood beside its uneven contact."""
ROUNDS = 3
"""The shared part is as uncertain as the slides' own deviations let it be, and these are what it leaves."""


@dataclass(frozen=True, eq=False)
class ExpectedDirections:
    """Expected deviations from the steepest line at the nodes (n, 3), rad, and their errors (n,) at the middle.

    `common_rad` (n, 3) is the part that similar runs share.
    """

    off_rad: Array
    sigma_rad: Array
    common_rad: Array


def expected_directions(
    off_rad: Array, sigma_rad: Array, angles_rad: Sequence[Array], run: Times, *, turning: Array | None = None
) -> ExpectedDirections:
    """Returns the expectation of deviations from the steepest line, for slides at angles (n, 3) each, rad.

    The angles are those on which a law may depend: down the slope in the plate, from the plate's texture, in the block.
    A turning block is carried aside as well (`station.physics.sole`).

    Args:
        off_rad: (n, 3) the deviations as measured, rad.
        sigma_rad: (n,) their standard errors, which the rows of a run have in common, rad.
        angles_rad: the angles, each (n, 3), on which a law may depend, rad.
        run: (n,) the run of each slide.
        turning: (n, 3) by how far the blocks turn on the width of their sole, rad; None if that is not known.
    """
    if len(off_rad) == 0:
        return ExpectedDirections(off_rad, sigma_rad, off_rad)
    sigma = np.maximum(sigma_rad, LEAST_RAD)
    most = float(np.quantile(np.abs(off_rad), FAR))
    clipped, common = np.clip(off_rad, -most, most), np.zeros_like(off_rad)
    own = true_variance(off_rad[:, 1], sigma)
    for _ in range(ROUNDS):
        common = _common(clipped, np.sqrt(sigma**2 + own), angles_rad, run, turning)
        own = true_variance((off_rad - common)[:, 1], sigma)
    left = off_rad - common
    trust = own / (own + sigma**2)
    return ExpectedDirections(common + trust[:, None] * left, np.sqrt(trust) * sigma, common)


def _common(off_rad: Array, sigma_rad: Array, angles_rad: Sequence[Array], run: Times, turning: Array | None) -> Array:
    """Gives the part (n, 3) of the deviations that harmonics of the angles explain; each angle and order is a group."""
    waves = [function(k * angle.ravel()) for angle in angles_rad for k in HARMONICS for function in (np.cos, np.sin)]
    groups = np.r_[0, 1 + np.arange(len(waves)) // 2]
    if turning is not None:
        waves, groups = [*waves, turning.ravel()], np.r_[groups, 1 + len(waves) // 2]
    design = np.column_stack([np.ones(off_rad.size), *waves])
    rows = np.bincount(run)[run] * off_rad.shape[1]
    weight = np.repeat(1.0 / (rows * sigma_rad**2), off_rad.shape[1])
    found = relevant(design, off_rad.ravel(), weight, groups)
    return (design @ found).reshape(off_rad.shape)


def true_variance(left: Array, sigma: Array) -> float:
    """Returns the variance of true values about zero, from measured ones `left` (n,) with errors `sigma` (n,)."""
    squared = np.minimum(left**2, float(np.quantile(left**2, FAR)))
    return max(float(np.average(squared / KEPT - sigma**2, weights=sigma**-4.0)), 0.0)

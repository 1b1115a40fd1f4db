"""Values that the recording leaves likely for a rival: a plan's promise is the mean over them, its assurance.

The likeliest values alone promise too much. A size that was found is rather too large than too small, a session has the
fewer runs for it, and these tell less where the true size is smaller (O'Hagan, Stevens, Campbell 2005, Pharm. Stat. 4,
187). `tests/benchmarks/test_next_experiment.py` compares promises with what sessions tell.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from station.diagnosis.inference.fit import Fit
from station.diagnosis.next_experiment.outlook import Rival
from station.physics.contact import Array


def likely_values(fitted: Fit, rival: Rival) -> Iterator[Rival]:
    """Yields the rival at its likeliest values, and at two along each direction of its numbers' k-dimensional Gaussian.

    These sigma points and their weights have the mean and the covariance that the numbers were `fitted` with (Julier,
    Uhlmann 1997, SPIE 3068, 182; their kappa is 1). A value beyond the bounds of its law is put on them.
    """
    free, covariance = fitted.of_effect(rival.id)
    share = rival.weight / (len(free) + 1)
    yield replace(rival, weight=share)
    away = math.sqrt(len(free) + 1) * _root(covariance).T
    for off in (*away, *-away):
        values = {one.name: one.clipped(rival.term.values[one.name] + by) for one, by in zip(free, off, strict=True)}
        yield replace(rival, term=rival.term.with_values(**values), weight=0.5 * share)


def _root(covariance: Array) -> Array:
    """Returns a square root (k, k) of a covariance (k, k), which may be singular."""
    squares, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(squares, 0.0)))

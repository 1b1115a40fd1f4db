"""Standard errors from the expected curvature, widened where the runs scatter more than the likelihood says."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.likelihood.student import expected_information
from station.diagnosis.observations.plate import Times
from station.physics.contact import Array, Bools

UNIFORM = 12.0
"""A uniform distribution's squared width over its variance."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Curvature:
    """The likelihood around a fit: slopes (n, k) of n components by k numbers; the rest is (n,).

    `pull` and `curve` are those of `student.pulls`, `tail` the degrees of freedom, `limit` marks censored components,
    and `run` is each component's run.
    """

    slope: Array
    pull: Array
    curve: Array
    tail: Array
    limit: Bools
    run: Times

    def covariance(self, precision: Array, width: Array) -> Array:
        """Returns the covariance (k, k) of the numbers.

        A number that the runs do not determine gets the variance of a uniform distribution over its range. A number at
        a bound gets the error of any other: how near to its bound it is known to be.

        A Newton step's weights (ν + 1) / (ν + w²) are 1 on average, and the information of Student's t is (ν + 1) / (ν
        + 3). Each number's variance is the larger of that and of the sandwich with the runs as clusters (Huber 1967;
        Liang & Zeger 1986, Biometrika 73, 13), the latter shrunk to the former where the runs are few. A number that
        its prior determines takes no run.

        Args:
            precision: (k,) that of the numbers' priors.
            width: (k,) the length of their ranges.
        """
        weight = expected_information(self.curve, self.tail, self.limit)
        table = self.slope
        among = (table * weight[:, None]).T @ table + np.diag(precision)
        of_model = _inverse(among + np.diag(UNIFORM / width**2))
        share = np.zeros((int(self.run.max(initial=0)) + 1, table.shape[1]))
        np.add.at(share, self.run, table * self.pull[:, None])
        runs = len(np.unique(self.run))
        known_before = float(np.diag(of_model) @ precision)
        meat = share.T @ share * (runs / max(runs - table.shape[1] + known_before, 1.0)) + np.diag(precision)
        sandwich = of_model @ meat @ of_model
        ratio = np.diag(sandwich) / np.maximum(np.diag(of_model), 1e-300)
        wider = 1.0 + (np.maximum(ratio, 1.0) - 1.0) * runs / (runs + thresholds.TRUSTED_AFTER_RUNS)
        scale = np.minimum(np.sqrt(wider), thresholds.MOST_WIDER)
        return np.asarray(of_model * np.outer(scale, scale), dtype=np.float64)


def _inverse(information: Array) -> Array:
    """Returns the inverse of an information matrix (k, k), each number in units of its own size.

    Beside a number that a channel without noise knows to many digits the others would count as undetermined, without
    any error.
    """
    size = np.sqrt(np.diag(information))
    return np.linalg.pinv(information / np.outer(size, size), hermitian=True) / np.outer(size, size)

"""The rates at which blocks turn as they slide, without the noise of their measurement.

Friction against the turning grows with the rate. With the measured rate its coefficient would come out too small (the
dilution of a noisy regressor), and a pressure that leads the block, which makes it smaller, would seem proven by noise.
The measured rates are therefore replaced by their expectation (regression calibration; Carroll et al. 2006, Measurement
Error in Nonlinear Models, chapter 4).
"""

from __future__ import annotations

import numpy as np

from station.diagnosis.observations.directions import true_variance
from station.physics.contact import Array

LEAST_RAD_S = 1e-6
"""The least error of a rate, by which its own variance is divided."""


def expected_rates(rate_rad_s: Array, sigma_rad_s: Array) -> tuple[Array, Array]:
    """Returns the expected rates (n, 3) and their errors (n,), rad/s.

    Args:
        rate_rad_s: (n, 3) the measured rates at three moments of each of n stretches of a slide, rad/s.
        sigma_rad_s: (n,) the errors of the middle ones, rad/s.
    """
    sigma = np.maximum(sigma_rad_s, LEAST_RAD_S)
    own = true_variance(rate_rad_s[:, 1], sigma) if len(sigma) else 0.0
    trust = own / (own + sigma**2)
    return trust[:, None] * rate_rad_s, np.sqrt(trust) * sigma

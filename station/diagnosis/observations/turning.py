"""The rates at which blocks turn as they slide, without the noise of their measurement.

Friction against the turning grows with the rate. With the measured rate its coefficient would come out too small (the
dilution of a noisy regressor), and a pressure that leads the block, which makes it smaller, would seem proven by noise.
The measured rates are therefore replaced by their expectation (regression calibration; Carroll et al. 2006, Measurement
Error in Nonlinear Models, chapter 4).

A block whose friction acts beside its mass turns until the moment against the turning, ω L² / 12 v of its friction, is
as large (`station.physics.sole`): in each slide about as far a metre, however fast. So the rates are expected about
each slide's own turn a metre, and that about zero; a slow block's own rate over its speed is a fifth noise, where it
slides at 17 mm/s, and a leading pressure was then told as a friction by the direction that steers (a worn corner
without any scatter: .0045 for 0, its lead 0 for .12).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from station.diagnosis.observations.directions import true_variance
from station.physics.contact import Array

LEAST_RAD_S = 1e-6
"""The least error of a rate, by which its own variance is divided."""
LEAST_M_S = 1e-6
"""The least speed, by which a turn a metre is divided."""
LEAST_LEFT = 0.5
"""The share that is left of the deviations of two stretches; one alone has none to tell."""
ROUNDS = 3
"""A slide's own turn is as uncertain as its stretches' deviations let it be, and these are what it leaves."""


def expected_rates(
    rate_rad_s: Array, sigma_rad_s: Array, speed_m_s: Array, run: NDArray[np.int64]
) -> tuple[Array, Array]:
    """Returns the expected rates (n, 3) and their errors (n,), rad/s.

    Args:
        rate_rad_s: (n, 3) the measured rates at three moments of each of n stretches of slides, rad/s.
        sigma_rad_s: (n,) their errors at the middle moment, rad/s.
        speed_m_s: (n, 3) the speeds at these moments, m/s.
        run: (n,) the stretches' runs.
    """
    if not len(run):
        return rate_rad_s, sigma_rad_s
    speed = np.maximum(speed_m_s[:, 1], LEAST_M_S)
    turn, sigma = rate_rad_s[:, 1] / speed, np.maximum(sigma_rad_s, LEAST_RAD_S) / speed
    own, usual, usual_sigma = 0.0, np.zeros_like(turn), np.zeros_like(turn)
    for _ in range(ROUNDS):
        usual, usual_sigma = _of_slides(turn, np.sqrt(sigma**2 + own), run)
        # A slide's mean has taken a share of its few stretches' deviations.
        left = np.maximum(1.0 - usual_sigma**2 / (sigma**2 + own), LEAST_LEFT)
        own = true_variance((turn - usual) / np.sqrt(left), sigma)
    trust = own / (own + sigma**2)
    error = np.hypot(np.sqrt(trust) * sigma, (1.0 - trust) * usual_sigma)
    usual_rate = usual[:, None] * speed_m_s
    return usual_rate + trust[:, None] * (rate_rad_s - usual_rate), error * speed


def _of_slides(turn: Array, sigma: Array, run: NDArray[np.int64]) -> tuple[Array, Array]:
    """Returns the expected turn a metre (n,) of each stretch's slide and its error (n,), rad/m.

    They are the means of the stretches' own (n,), weighed by their errors `sigma` (n,).
    """
    slides, index = np.unique(run, return_inverse=True)
    weight = np.bincount(index, sigma**-2.0, len(slides)).astype(np.float64)
    found, error = np.bincount(index, turn / sigma**2, len(slides)) / weight, weight**-0.5
    own = true_variance(found, error)
    trust = own / (own + error**2)
    return (trust * found)[index], (np.sqrt(trust) * error)[index]

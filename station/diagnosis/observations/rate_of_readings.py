"""The plate's rates by the readings of its attitude, for an arm that records none, or none that agree with them.

A difference of two readings 10 ms apart has 140 times their noise, 1/s, and the accelerations as much again. Gravity's
components are smoothed first, as the rates of an arm that records them (`rate_noise`), by the penalty that predicts
left-out readings best: generalised cross-validation (Craven and Wahba 1979, Numerische Mathematik 31, 377) over the
readings about which the plate moves. Cheap servos tell angles to .09 degrees, and at rest they say nothing of that.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize_scalar

from shared.vectors import cross
from station.diagnosis.observations.attitude_fit import AttitudeFit, parts_of
from station.diagnosis.observations.rate_lag import derivative
from station.diagnosis.observations.rate_noise import (
    ENOUGH,
    LOG_PENALTIES,
    ORDER,
    changing,
    gain,
    resting_noise,
    smoothed,
)
from station.physics.contact import Array


def of_readings(time_s: Array, gravity: Array) -> AttitudeFit:
    """Returns gravity and rates by the readings alone; what these have beside the smooth motion is noise.

    A turn about gravity is unseen.

    Args:
        time_s: (n,) times of the readings, s, at equal intervals but for gaps.
        gravity: (n, 3) unit vectors in P.
    """
    parts = parts_of(time_s)
    penalty = _penalty(gravity[:ENOUGH], parts)
    smooth = _smooth(gravity, penalty, parts)
    smooth /= np.linalg.norm(smooth, axis=1, keepdims=True)
    own = gain(penalty)
    noise = float(np.sqrt(np.square(gravity - smooth)[:, :2].mean() / (1.0 - own)))
    return AttitudeFit(
        gravity=smooth,
        rate_rad_s=-cross(smooth, derivative(smooth, time_s, parts)),
        sigma_rad=np.full(len(time_s), noise * np.sqrt(own)),
        noise_rad=noise,
        keeps=(1.0 - own) / (1.0 + own),
        delay_s=0.0,
        delay_sd_s=np.inf,
        by_readings=True,
    )


def _smooth(gravity: Array, penalty: float, parts: Sequence[slice]) -> Array:
    """Returns gravity (n, 3), smooth in each of its parts; one of few readings stays as it is."""
    found = gravity.copy()
    for part in parts:
        own = gravity[part]
        if len(own) > ORDER:
            found[part] = smoothed(own, penalty)
    return found


def _penalty(gravity: Array, parts: Sequence[slice]) -> float:
    """Returns the penalty that predicts readings (n, 3) best from the others, where the plate moves."""
    moving = changing(gravity, resting_noise(gravity))

    def missed(log_penalty: float) -> float:
        left = (gravity - _smooth(gravity, np.exp(log_penalty), parts))[moving]
        return float(np.square(left).mean()) / (1.0 - gain(np.exp(log_penalty))) ** 2

    return float(np.exp(minimize_scalar(missed, bounds=LOG_PENALTIES, method="bounded", options={"xatol": 0.1}).x))


def agree(rate_rad_s: Array, gravity: Array, time_s: Array) -> bool:
    """Returns true if rates tell the steps of gravity better than rates of 0.

    Args:
        rate_rad_s: (n, 3) the recorded rates in P, rad/s.
        gravity: (n, 3) unit vectors in P.
        time_s: (n,) times of the readings, s.
    """
    turning = -cross(rate_rad_s, gravity)
    # The rates before and after a gap do not tell what the arm did in it.
    within = np.ones(len(time_s) - 1, dtype=np.bool_)
    within[[part.start - 1 for part in parts_of(time_s)[1:]]] = False
    steps = np.diff(gravity, axis=0)[within]
    told = (0.5 * (turning[1:] + turning[:-1]) * np.diff(time_s)[:, None])[within]
    return bool(np.square(steps - told).sum() < np.square(steps).sum())

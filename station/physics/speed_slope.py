"""The slope of a speed law over the recorded speeds, which slides determine whatever the law's own numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from station.physics.contact import Contact
from station.physics.effect import Effect, Values

OF_STATIC = "mu_s"
"""The unit of a quantity that is relative to the static friction of its model."""

SHARES = (0.25, 0.75)
"""The quartiles of the different recorded speeds between which the slope is taken."""


def speed_slope(effect: Effect, contact: Contact, values: Values) -> Mapping[str, tuple[float, str]]:
    """Returns the change of friction per e-fold of speed between the recorded speeds' quartiles, over static friction.

    It is empty where nothing slides.
    """
    speeds = contact.speed_m_s[contact.moving]
    if not len(speeds):
        return {}
    different = np.unique(speeds)  # a drive may stay at one speed for most of the time
    low = float(np.quantile(different, SHARES[0], method="lower"))
    high = float(np.quantile(different, SHARES[1], method="higher"))
    if not 0.0 < low < high:
        return {}
    one = contact.chosen(np.flatnonzero(contact.moving)[:1].repeat(2))
    slow, fast = np.ravel(effect.friction(replace(one, speed_m_s=np.array([low, high])), values)).tolist()
    words = f"change of friction per e-fold of speed, {1e3 * low:.3g} to {1e3 * high:.3g} mm/s"
    return {words: ((fast - slow) / math.log(high / low), OF_STATIC)}

"""Stribeck fall: friction falls from the static to the kinetic level over a speed scale, not at once.

mu(v) = mu_s (1 − d (1 − s)): continuous with rest, (1 − d) mu_s when v is far above v_s. What is left of the fall,
s = (1 + q (v / v_s)^n)^(−1/q) with q = τ max(n − 1, 0), is the lubricant's and the surface's: exp(−(v / v_s)^n) up to
n = 1 (Tustin's at 1, Bo & Pavelescu's from 1/2) and with the tail τ = 0, which at n = 2 is the Gaussian that most
controllers have; with τ = 1 it is the Lorentzian 1 / (1 + (v / v_s)²) of Hess & Soom at n = 2. At 2 v_s the Gaussian
fall is over, and the Lorentzian has a fifth to go: one taken for the other seems to have a further law of the speed.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter
from station.physics.speed_slope import speed_slope

LIGHTEST = 1e-6
"""The smallest q, at which the law is an exponential to six digits."""


class Stribeck(Effect):
    """Friction falls with the speed of sliding."""

    id: ClassVar[str] = "stribeck"
    title: ClassVar[str] = "fall of friction with speed"
    law: ClassVar[str] = "mu(v) = mu_s (1 - d (1 - s)), s from exp(-(v / v_s)^n) to 1 / (1 + (v / v_s)^2) (d = 0)"
    source: ClassVar[str] = (
        "Stribeck 1902; Bo & Pavelescu 1982, Wear 82, 277 (the exponential form); Hess & Soom 1990, J. Tribol. 112, "
        "147 (the Lorentzian); Armstrong-Hélouvry et al. 1994, Automatica 30, 1083 (the Gaussian)"
    )
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "speed law"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="drop", symbol="d", unit="1", low=0.0, high=0.6, typical=0.1),
        Parameter(
            name="speed_m_s",
            symbol="v_s",
            unit="m/s",
            low=1e-4,
            high=0.3,
            typical=0.02,
            null=None,
            starts=(0.02, 0.002, 0.0003, 0.1),
        ),
        Parameter(name="exponent", symbol="n", unit="1", low=0.5, high=2.0, typical=0.5, null=None, starts=(1.0,)),
        Parameter(name="tail", unit="1", low=0.0, high=1.0, typical=0.5, null=None, starts=(1.0,)),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("kinetic_drop", "viscous", "rate_strengthening")
    separated_by: ClassVar[str] = "slow slides: fine tilt steps around the onset, so that speeds below v_s are seen"
    demonstrated: ClassVar[Values] = {"drop": 0.3}

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """Gives the factor (n,) on friction by the law of this module."""
        power = (contact.speed_m_s / values["speed_m_s"]) ** values["exponent"]
        tail = max(values["tail"] * (values["exponent"] - 1.0), LIGHTEST)
        fallen = -np.expm1(-np.log1p(tail * power) / tail)
        return np.where(contact.moving, 1.0 - values["drop"] * fallen, 1.0)

    def derived(self, contact: Contact, values: Values) -> Mapping[str, tuple[float, str]]:
        """Returns the slope of friction by speed, which the law's size and shape share."""
        return speed_slope(self, contact, values)

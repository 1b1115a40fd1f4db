"""Load dependence: real contact area grows more slowly than the load, so the coefficient falls with it.

m = s(N) / s(N_ref), s(N) = (1 + (N / N0)²)^(−n/2), N = m g cos θ, N_ref = 0.1 N: a power of the load far above N0, and
Amontons' law far below, where only the tips of a rough sole touch and each further load makes more of them. n = 1/3 for
one elastic sphere (Hertz), about 0 for rough hard surfaces; an n above 0 is what soft soles show. mu_s is the
coefficient at N_ref.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter

REFERENCE_N = 0.1
LEAST_N = 1e-3
SAME = 0.02
"""Masses that differ by less than this share count as one."""

WIDE = 10.0
"""The ratio of the largest to the smallest load over which a power law may show where it begins."""

SHARES = (0.05, 0.95)
"""The quantiles of the recorded loads between which the fall is told."""


class LoadDependence(Effect):
    """The coefficient falls with the normal force."""

    id: ClassVar[str] = "load_dependence"
    title: ClassVar[str] = "friction by load"
    law: ClassVar[str] = "mu = mu_s (N / 0.1 N)^-n above a load N0, constant below (n = 0)"
    source: ClassVar[str] = (
        "Schallamach 1952, Proc. Phys. Soc. B 65, 657 (n = 1/3 for rubber); Archard 1957, Proc. R. Soc. A 243, 190; "
        "Greenwood & Tripp 1967, J. Appl. Mech. 34, 153 (a rough sphere: at high loads as a smooth one)"
    )
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "load"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="exponent", symbol="n", unit="1", low=0.0, high=0.6, typical=0.1),
        Parameter(
            name="from_log10_n",
            symbol="log10 N0",
            unit="log10 N",
            low=-4.0,
            high=1.0,
            typical=0.5,
            null=None,
            starts=(-4.0, -1.0),
        ),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("adhesion",)
    separated_by: ClassVar[str] = "loads in random order over a range of ten to one: a power law against an added force"
    absorbed_by_mu: ClassVar[bool] = True

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """Gives the factor (n,) on friction by the law of this module."""
        load = np.maximum(contact.mass_kg * contact.pressing_m_s2, LEAST_N)
        square = 100.0 ** values["from_log10_n"]
        return ((square + load**2) / (square + REFERENCE_N**2)) ** (-0.5 * values["exponent"])

    def idle(self, contact: Contact) -> frozenset[str]:
        """Returns the load at which the fall begins, if loads span less than WIDE.

        In that case nothing tells it from a smaller exponent.
        """
        load = contact.mass_kg * contact.pressing_m_s2
        return frozenset() if len(load) and load.max() > WIDE * load.min() else frozenset({"from_log10_n"})

    def derived(self, contact: Contact, values: Values) -> Mapping[str, tuple[float, str]]:
        """Returns the fall of friction per e-fold of the load, which exponent and beginning share."""
        load = contact.mass_kg * contact.pressing_m_s2
        low, high = np.quantile(load, SHARES).tolist()
        if not LEAST_N < low < high:
            return {}
        square = 100.0 ** values["from_log10_n"]
        fall = 0.5 * values["exponent"] * math.log((square + high**2) / (square + low**2)) / math.log(high / low)
        return {f"fall of ln friction per e-fold of the load, {low:.3g} to {high:.3g} N": (fall, "1")}

    def why_untestable(self, contact: Contact) -> str | None:
        """Runs with one mass cannot show it: the load's exponent is then another mu."""
        if np.ptp(contact.mass_kg) > SAME * np.mean(contact.mass_kg):
            return None
        return "All runs have one mass, and then the load's exponent is the same as another mu; add a second mass."

"""Load dependence: real contact area grows more slowly than the load, so the coefficient falls with it.

m = (N / N_ref)^−n, N = m g cos θ, N_ref = 0.1 N. n = 1/3 for one elastic sphere (Hertz), about 0 for rough hard
surfaces; an n above 0 is what soft soles show. mu_s is the coefficient at N_ref.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter

REFERENCE_N = 0.1
LEAST_N = 1e-3
SAME = 0.02
"""Masses that differ by less than this share count as one."""


class LoadDependence(Effect):
    """The coefficient falls with the normal force."""

    id: ClassVar[str] = "load_dependence"
    title: ClassVar[str] = "friction by load"
    law: ClassVar[str] = "mu = mu_s (N / 0.1 N)^-n (n = 0)"
    source: ClassVar[str] = "Schallamach 1952, Proc. Phys. Soc. B 65, 657 (n = 1/3 for rubber); Archard 1957"
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "load"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="exponent", unit="1", low=0.0, high=0.6, typical=0.1),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("adhesion",)
    separated_by: ClassVar[str] = "loads in random order over a range of ten to one: a power law against an added force"
    absorbed_by_mu: ClassVar[bool] = True

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """See the module."""
        load = np.maximum(contact.mass_kg * contact.pressing_m_s2, LEAST_N)
        return (load / REFERENCE_N) ** -values["exponent"]

    def why_untestable(self, contact: Contact) -> str | None:
        """See the base class."""
        if np.ptp(contact.mass_kg) > SAME * np.mean(contact.mass_kg):
            return None
        return "All runs have one mass, and then the load's exponent is the same as another mu; add a second mass."

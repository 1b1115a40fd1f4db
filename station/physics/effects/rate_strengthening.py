"""Rate strengthening: friction changes with the logarithm of the sliding speed.

mu = mu_s (1 + a n(v / v0)) has the static friction at v = 0, is linear in v below the cut-off speed v0, and grows by
e-folds above it: n(u) = (1 - b) ln(1 + u) + b asinh(u / 2). With b = 0 a contact is never younger than its shortest
life. With b = 1 slips are thermally activated and go both ways, with the load and against it, so that near v = 0 as
many come back (Eyring 1936; Rice, Lapusta and Ranjith 2001): friction is half as steep there. Only friction that grows
with the speed is of such slips. v0 is 10 mm/s or some decades less: a contact's memory length (1 to 10 µm) over its
shortest life (0.1 ms or more; rock and gouge keep to the logarithm down to nm/s: Marone 1998, Annu. Rev. Earth Planet.
Sci. 26, 643). Both signs occur: a > 0 strengthens, a < 0 weakens. Rock and metal have |a| of some hundredths; plastics
and rubber, whose friction is viscoelastic, change several times over a few decades of speed, by 0.1 to 0.2 an e-fold (a
tossed plastic cube: 0.11).

A contact whose friction grows with the speed creeps below its limit, too: thermally activated, it slips at v0 exp((q -
1) / a) under the share q of its limit (Baumberger & Caroli 2006). The creep is c times that, and c = 0 is a contact
that holds still until it slides. A level of its own that sliding has below the static one is another effect's
(`kinetic_drop`), and so is a fall that only begins at higher speeds (`stribeck`).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter
from station.physics.speed_slope import speed_slope

FASTEST_M_S = 0.1

NEAREST_M_S2 = 3e-3
"""A block that is nearer to its limit, .02° of tilt, creeps as there: creep that began with a jump would leave a fit no
slope at a = 0 (`pytest tests/contracts/test_effects.py -k smooth_at_the_null`, which fails with a third of it)."""

SLIGHT = 1e-3
"""Friction that grows by less an e-fold is that of slips one way: where it begins to grow, the form must not jump
(`pytest tests/contracts/test_effects.py -k smooth_at_the_null`). At .005 the form is 96 % of what was asked for."""

LEAST_M_S2 = 1e-9
"""Friction that changes by less an e-fold has no creep: it guards the division by it."""


class RateStrengthening(Effect):
    """Kinetic friction depends on the logarithm of the speed."""

    id: ClassVar[str] = "rate_strengthening"
    title: ClassVar[str] = "friction by the logarithm of speed"
    law: ClassVar[str] = (
        "mu = mu_s (1 + a ln(1 + u)), or asinh(u / 2) for ln(1 + u), while sliding, u = 10^k v / (0.1 m/s); and creep "
        "(a = 0)"
    )
    source: ClassVar[str] = (
        "Baumberger & Caroli 2006, Adv. Phys. 55, 279; Bar-Sinai et al. 2014, JGR Solid Earth 119, 1738; Dieterich "
        "1979, JGR 84, 2161; Eyring 1936, J. Chem. Phys. 4, 283; Rice, Lapusta & Ranjith 2001, J. Mech. Phys. Solids "
        "49, 1865; of plastics and rubber McLaren & Tabor 1963, Nature 197, 856; Grosch 1963, "
        "Proc. R. Soc. A 274, 21"
    )
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "speed law"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="per_e_fold", symbol="a", unit="1", low=-0.2, high=0.2, typical=0.02),
        Parameter(
            name="slower_decades",
            symbol="k",
            unit="1",
            low=1.0,
            high=8.0,
            typical=0.5,
            null=None,
            starts=(1.5, 1.0, 3.0, 6.0),
        ),
        Parameter(name="both_ways", unit="1", low=0.0, high=1.0, typical=0.5, null=None, starts=(0.0, 1.0)),
        Parameter(name="creep_share", unit="1", low=0.0, high=1.0, typical=0.3, null=None, starts=(0.05,)),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("viscous", "stribeck", "lens_distortion", "friction_patch")
    separated_by: ClassVar[str] = "the same speed at another place: starts spread over the plate and several tilt rates"
    demonstrated: ClassVar[Values] = {"per_e_fold": 0.06}

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """Gives the factor (n,) on friction by the law of this module."""
        factor = 1.0 + values["per_e_fold"] * _e_folds(contact.speed_m_s / _cut_off_m_s(values), values)
        return np.where(contact.moving, np.maximum(factor, 0.0), 1.0)

    def creep(self, contact: Contact, values: Values) -> Array | None:
        """Gives the velocity (n, 2), m/s, of a block below its limit; friction that falls with the speed has none."""
        spare = np.maximum(contact.spare_m_s2, NEAREST_M_S2)
        e_fold = np.maximum(values["per_e_fold"] * (spare + contact.pulling_m_s2), LEAST_M_S2)
        speed = values["creep_share"] * _cut_off_m_s(values) * np.exp(-spare / e_fold)
        return np.where(contact.moving | (values["per_e_fold"] <= 0.0), 0.0, speed)[:, None] * contact.down

    def derived(self, contact: Contact, values: Values) -> Mapping[str, tuple[float, str]]:
        """Returns the slope of friction by speed, which the law's size and shape share."""
        return speed_slope(self, contact, values)


def _e_folds(speed: Array, values: Values) -> Array:
    """Returns n (n,) at `speed` (n,) in units of the cut-off."""
    one_way, strengthens = np.log1p(speed), max(values["per_e_fold"], 0.0) ** 2
    back = values["both_ways"] * strengthens / (strengthens + SLIGHT**2)
    return one_way + back * (np.arcsinh(0.5 * speed) - one_way)


def _cut_off_m_s(values: Values) -> float:
    """Returns the speed v0, m/s, below which friction is linear in the speed."""
    return float(FASTEST_M_S * 10.0 ** -values["slower_decades"])

"""Rate strengthening: friction changes with the logarithm of the sliding speed.

mu = mu_s (1 + a ln((v + v_c) / v0)). At the speed v0, 0.1 m/s or some decades less, sliding meets the static friction;
the cut-off v_c = 1 mm/s keeps slow sliding finite. Both signs occur: a > 0 strengthens, a < 0 weakens. Rock and metal
have |a| of some hundredths; plastics and rubber, whose friction is viscoelastic, change several times over a few
decades of speed, by 0.1 to 0.2 an e-fold (a tossed plastic cube: 0.11). Beyond 1 / ln 100 = 0.217 the law with
v0 = 0.1 m/s would have no friction at rest.

At rest the static level stands, so with a < 0 a slow slide meets more friction than rest does: a simulator starts such
a block when the load exceeds both.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter

FASTEST_M_S = 0.1
CUT_OFF_M_S = 1e-3


class RateStrengthening(Effect):
    """Kinetic friction depends on the logarithm of the speed."""

    id: ClassVar[str] = "rate_strengthening"
    title: ClassVar[str] = "friction by the logarithm of speed"
    law: ClassVar[str] = "mu = mu_s (1 + a ln((v + 1 mm/s) / v0)) while sliding (a = 0)"
    source: ClassVar[str] = (
        "Bar-Sinai et al. 2014, JGR Solid Earth 119, 1738; Dieterich 1979, JGR 84, 2161; of plastics and rubber "
        "McLaren & Tabor 1963, Nature 197, 856; Grosch 1963, Proc. R. Soc. A 274, 21"
    )
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "speed law"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="per_e_fold", unit="1", low=-0.2, high=0.2, typical=0.02),
        Parameter(name="slower_decades", unit="1", low=0.0, high=2.0, typical=0.5, null=None, starts=(0.0, 1.5)),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("viscous", "stribeck", "lens_distortion", "friction_patch")
    separated_by: ClassVar[str] = "the same speed at another place: starts spread over the plate and several tilt rates"

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """See the module."""
        e_folds = np.log((contact.speed_m_s + CUT_OFF_M_S) / FASTEST_M_S) + np.log(10.0) * values["slower_decades"]
        return np.where(contact.moving, np.maximum(1.0 + values["per_e_fold"] * e_folds, 0.0), 1.0)

"""Presliding: a block on a slope shifts a little before it slides, by the shear of its sole.

Along the slope, u = q (e + k log10(1 + t / 1 s)): an elastic part e, gone when the plate is level again, and a creeping
part k per decade of the time t on the slope. The load is q = 0.3 (g / 0.3)^n: n = 1 where it yields evenly (e and k
are metres at 45°), more where asperities let go one after another as it grows. Hard contacts shift by nanometres.

Up to the share b of the load under which it slides a sole is elastic, and g = tan θ. Beyond, its bristles slip one
after another: at the share s = tan θ / tan θ_slip its stiffness has fallen to (1 − s) / (1 − b) of what it was, so that
g = tan θ_slip (b + (1 − b) ln((1 − b) / (1 − s))). At b = 0 that is Dahl's law, at b = 1 an elastic sole.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, View
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter

USUAL = 0.3
"""The slope at which blocks typically slide: there the exponent changes nothing."""

STEEPEST = 5.0
"""The largest ratio of load to normal force; a larger one is clipped."""

LEAST_LIMIT = 1e-3
"""The slope of a limit below which it stands for none: a run that ended on the level plate."""

NEAREST = 0.999
"""The largest share of the load under which a block slides; nearer to it the law has no end."""


class Presliding(Effect):
    """The block shears on its sole below the onset."""

    id: ClassVar[str] = "presliding"
    title: ClassVar[str] = "presliding of a soft sole"
    law: ClassVar[str] = (
        "shift 0.3 (tan(tilt) / 0.3)^n (e + k log10(1 + t / s)) down the slope, more beyond the share b of the limit "
        "(e = k = 0)"
    )
    source: ClassVar[str] = (
        "Mindlin 1949, J. Appl. Mech. 16, 259 (elastic); Heslot et al. 1994, PRE 49, 4973 (creep); Dahl 1968, "
        "Aerospace Corp. TOR-0158(3107-18)-1 (yielding towards the onset); Dupont et al. 2002, IEEE Trans. Autom. "
        "Control 47, 787 (elastic below a share of it)"
    )
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "image"
    strains: ClassVar[bool] = False
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="elastic_m", symbol="e", unit="m", low=0.0, high=5e-3, typical=1e-4),
        Parameter(name="creep_m_per_decade", symbol="k", unit="m", low=0.0, high=2e-2, typical=5e-5),
        Parameter(name="exponent", symbol="n", unit="1", low=1.0, high=4.0, typical=0.5, null=None, starts=(1.0,)),
        Parameter(name="elastic_share", symbol="b", unit="1", low=0.0, high=1.0, typical=0.3, null=None, starts=(0.6,)),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("camera_sag", "solver_creep")
    separated_by: ClassVar[str] = "fiducials fixed to the plate, and runs that go back to level before the onset"
    demonstrated: ClassVar[Values] = {"elastic_m": 0.0003}

    def seen(self, view: View, values: Values) -> Array | None:
        """Gives the displacement (n, 4, 2), m, of the corners' images by the law of this module."""
        if not view.on_block:
            return None
        load = USUAL * (_given(view, values["elastic_share"]) / USUAL) ** values["exponent"]
        decades = np.log10(1.0 + np.maximum(view.rest_s, 0.0))
        shift = load * (values["elastic_m"] + values["creep_m_per_decade"] * decades)
        return view.shifted(shift[:, None] * view.down)


def _given(view: View, elastic_share: float) -> Array:
    """Returns the slope g (n,) at which an elastic sole would have sheared as far, by the law of this module."""
    slope, limit = (np.clip(np.tan(np.minimum(angle, 1.5)), 0.0, STEEPEST) for angle in (view.tilt_rad, view.limit_rad))
    known = limit > LEAST_LIMIT  # False also where it is nan
    share = np.minimum(np.divide(slope, limit, out=np.zeros(len(slope)), where=known), NEAREST)
    yields, left = share > elastic_share, max(1.0 - elastic_share, 1.0 - NEAREST)
    given = limit * (elastic_share + left * np.log(left / (1.0 - share)))
    return np.where(yields, given, slope)

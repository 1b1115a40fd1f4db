"""Presliding: a block on a slope shifts a little before it slides, by the shear of its sole.

Along the slope, u = q (e + k log10(1 + t / 1 s)): an elastic part e, gone when the plate is level again, and a creeping
part k per decade of the time t on the slope. The load is q = 0.3 (tan θ / 0.3)^n: n = 1 where it yields evenly (e and k
are metres at 45°), more where asperities let go one after another as the onset comes near. Hard contacts shift by
nanometres.
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


class Presliding(Effect):
    """The block shears on its sole below the onset."""

    id: ClassVar[str] = "presliding"
    title: ClassVar[str] = "presliding of a soft sole"
    law: ClassVar[str] = "shift 0.3 (tan(tilt) / 0.3)^n (e + k log10(1 + t / s)) down the slope (e = k = 0)"
    source: ClassVar[str] = (
        "Mindlin 1949, J. Appl. Mech. 16, 259 (elastic); Heslot et al. 1994, PRE 49, 4973 (creep); Dahl 1968, "
        "Aerospace Corp. TOR-0158(3107-18)-1 (yielding towards the onset)"
    )
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "image"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="elastic_m", unit="m", low=0.0, high=5e-3, typical=1e-4),
        Parameter(name="creep_m_per_decade", unit="m", low=0.0, high=2e-2, typical=5e-5),
        Parameter(name="exponent", unit="1", low=1.0, high=4.0, typical=0.5, null=None, starts=(1.0,)),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("camera_sag", "solver_creep")
    separated_by: ClassVar[str] = "fiducials fixed to the plate, and runs that go back to level before the onset"
    demonstrated: ClassVar[Values] = {"elastic_m": 0.0003}

    def seen(self, view: View, values: Values) -> Array | None:
        """Gives the displacement (n, 4, 2), m, of the corners' images by the law of this module."""
        if not view.on_block:
            return None
        slope = np.clip(np.tan(np.minimum(view.tilt_rad, 1.5)), 0.0, STEEPEST)
        load = USUAL * (slope / USUAL) ** values["exponent"]
        decades = np.log10(1.0 + np.maximum(view.rest_s, 0.0))
        shift = load * (values["elastic_m"] + values["creep_m_per_decade"] * decades)
        return np.broadcast_to((shift[:, None] * view.down)[:, None, :], view.point_m.shape)

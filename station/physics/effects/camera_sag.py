"""Camera sag: the mount bends under its own weight, and everything on the plate seems to move.

A mount that bends alike to all sides under the weight's part along the plate, m g sin θ, shifts the image of the plate
down the slope by k sin θ, k the shift that a vertical plate would show, in metres at the height of the block's mark
(linear elasticity; Dressel et al. allow for it). What pulls in a direction of its own as the plate tilts, as a cable
does, shifts it in a direction that is fixed in the camera, and so in P: by (fx, fy) sin θ. Block and fixed fiducials
shift alike, reversibly, in every run; slopes to opposite sides tell the two apart.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, View
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter


class CameraSag(Effect):
    """The camera's mount bends with the tilt."""

    id: ClassVar[str] = "camera_sag"
    title: ClassVar[str] = "sag of the camera"
    law: ClassVar[str] = (
        "the image shifts by k sin(tilt) down the slope, and by (fx, fy) sin(tilt) in the plate, told at the height of "
        "the block's mark (all 0)"
    )
    source: ClassVar[str] = "Dressel et al., section III (a threshold of 10 px + 1 px a degree allows for it)"
    layer: ClassVar[Layer] = "camera"
    family: ClassVar[Family] = "image"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="shift_m", symbol="k", unit="m", low=-0.02, high=0.02, typical=1e-3),
        Parameter(name="fixed_x_m", symbol="fx", unit="m", low=-0.02, high=0.02, typical=1e-3),
        Parameter(name="fixed_y_m", symbol="fy", unit="m", low=-0.02, high=0.02, typical=1e-3),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("presliding",)
    separated_by: ClassVar[str] = "fiducials that are fixed to the plate: they sag, and do not creep"

    def seen(self, view: View, values: Values) -> Array | None:
        """Gives the displacement (n, 4, 2), m, of the corners' images by the law of this module."""
        fixed = np.array([values["fixed_x_m"], values["fixed_y_m"]])
        shift = np.sin(view.tilt_rad)[:, None] * (values["shift_m"] * view.down + fixed)
        return view.shifted(shift)

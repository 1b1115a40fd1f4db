"""Camera sag: the mount bends under its own weight, and everything on the plate seems to move.

The image of the plate shifts along the slope by k sin θ, k the shift (in metres on the plate) that a vertical plate
would show; block and fixed fiducials shift alike, reversibly, in every run.
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
    law: ClassVar[str] = "the image shifts by k sin(tilt) along the slope (k = 0)"
    source: ClassVar[str] = "Dressel et al., section III (a threshold of 10 px + 1 px a degree allows for it)"
    layer: ClassVar[Layer] = "camera"
    family: ClassVar[Family] = "image"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="shift_m", unit="m", low=-0.02, high=0.02, typical=1e-3),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("presliding",)
    separated_by: ClassVar[str] = "fiducials that are fixed to the plate: they sag, and do not creep"

    def seen(self, view: View, values: Values) -> Array | None:
        """See the module."""
        shift = values["shift_m"] * np.sin(view.tilt_rad)[:, None] * view.down
        return np.broadcast_to(shift[:, None, :], view.point_m.shape)

"""A nuisance of every camera: its map from pixels to the plate is known to a few parts in a thousand.

Nobody knows to a tenth of a degree where a camera's axes point, and by so much all blocks seem to slide beside the
steepest way down. A camera that is calibrated by one mark also sees the plate a little strained, and smaller on one
side where it leans. Of sessions without any effect that were seen by such cameras unnamed pushes, distortions of the
lens and other laws were told (`pytest tests/unit/diagnosis/test_mapping.py`). A session of the simulated rig had a
push aside of 0.9 mrad (p = 2e-9), by which its contact solver turned the slides.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, View
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter


class CameraMap(Effect):
    """The camera's map of the plate is a little turned and strained, and leans."""

    id: ClassVar[str] = "_camera_map"
    title: ClassVar[str] = "map from the camera's pixels to the plate"
    law: ClassVar[str] = (
        "displacement (aspect x + (shear - turn) y, (shear + turn) x - aspect y) - (lean_x x + lean_y y) (x, y) (all 0)"
    )
    source: ClassVar[str] = "the homography to first order: Hartley & Zisserman, Multiple View Geometry, section 2.4"
    layer: ClassVar[Layer] = "camera"
    family: ClassVar[Family] = "image"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        # A mark of 20 mm that is glued to 0.1 mm points to 0.3°; a fifth of a pixel of a mark's 100; 0.3° of a camera
        # 0.3 m above the plate.
        Parameter(name="turn_rad", unit="rad", low=-0.1, high=0.1, typical=0.005),
        *(Parameter(name=name, unit="1", low=-0.1, high=0.1, typical=0.002) for name in ("aspect", "shear")),
        *(Parameter(name=name, unit="1/m", low=-1.0, high=1.0, typical=0.02) for name in ("lean_x", "lean_y")),
    )
    separated_by: ClassVar[str] = "nothing: it is allowed for"

    def seen(self, view: View, values: Values) -> Array | None:
        """Returns the apparent displacement (n, points, 2), m, in P."""
        x, y = view.point_m[..., 0], view.point_m[..., 1]
        nearer = values["lean_x"] * x + values["lean_y"] * y
        aspect, shear, turn = values["aspect"], values["shear"], values["turn_rad"]
        seen = np.empty_like(view.point_m)
        seen[..., 0] = (aspect - nearer) * x + (shear - turn) * y
        seen[..., 1] = (shear + turn) * x - (aspect + nearer) * y
        return seen


CAMERA_MAP = CameraMap()

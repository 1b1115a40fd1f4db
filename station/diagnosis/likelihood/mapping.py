"""A nuisance of every camera: its map from pixels to the plate is known to a part in a thousand.

A camera that is calibrated by one mark sees the plate a little strained, and smaller on one side where it leans. Of a
session without any effect that was seen 0.1 % wider than it is high a distortion of the lens was told, and an unnamed
law beside it (`pytest tests/unit/diagnosis/test_heading.py`).
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import GRAVITY_M_S2, Array, Contact, View
from station.physics.effect import Effect, Family, Layer, Values, unit
from station.physics.parameter import Parameter


class CameraMap(Effect):
    """The camera's map of the plate is a little strained, and leans."""

    id: ClassVar[str] = "_camera_map"
    title: ClassVar[str] = "map from the camera's pixels to the plate"
    law: ClassVar[str] = "displacement (aspect x + shear y, shear x - aspect y) - (lean_x x + lean_y y) (x, y) (all 0)"
    source: ClassVar[str] = "the homography to first order: Hartley & Zisserman, Multiple View Geometry, section 2.4"
    layer: ClassVar[Layer] = "camera"
    family: ClassVar[Family] = "image"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        # A fifth of a pixel of a mark's 100, and 0.3° of a camera 0.3 m above the plate.
        *(Parameter(name=name, unit="1", low=-0.1, high=0.1, typical=0.002) for name in ("aspect", "shear")),
        *(Parameter(name=name, unit="1/m", low=-1.0, high=1.0, typical=0.02) for name in ("lean_x", "lean_y")),
    )
    separated_by: ClassVar[str] = "nothing: it is allowed for"

    def seen(self, view: View, values: Values) -> Array | None:
        """The apparent displacement (n, points, 2), m, in P."""
        x, y = view.point_m[..., 0], view.point_m[..., 1]
        nearer = values["lean_x"] * x + values["lean_y"] * y
        aspect, shear = values["aspect"], values["shear"]
        return np.stack([(aspect - nearer) * x + shear * y, shear * x - (aspect + nearer) * y], axis=-1)

    def push(self, contact: Contact, values: Values) -> Array | None:
        """The push (n, 3), m/s², in P, that a strained way seems to need.

        It goes aside by the angle by which the strain turns the way: friction acts against the true one. Friction is
        taken as large as gravity's pull, which it misses by the block's acceleration.
        """
        twice = 2.0 * contact.way_rad
        aside = values["shear"] * np.cos(twice) - values["aspect"] * np.sin(twice)
        size = aside * GRAVITY_M_S2 * np.sin(contact.tilt_rad) * contact.moving
        return np.column_stack([unit(contact.way_rad + np.pi / 2) * size[:, None], np.zeros(len(contact))])


CAMERA_MAP = CameraMap()

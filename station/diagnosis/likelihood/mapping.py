"""A nuisance of every camera: its map from pixels to the plate is known to a few parts in a thousand, its axes less.

A plate is screwed on by eye, and a mark is glued to it by hand. By what their axes are turned against the arm's, all
blocks seem to slide beside the steepest way down; people are told of it where it is more than that of a mark. A camera
that is calibrated by one mark also sees the plate a little strained, and smaller on one side where it leans. Of
sessions without any effect that were seen by such cameras unnamed pushes, distortions of the lens and other laws were
told (`pytest tests/unit/diagnosis/test_mapping.py`). A session of the simulated rig had a push aside of 0.9 mrad (p =
2e-9), by which its contact solver turned the slides.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import ClassVar

import numpy as np

from station.physics.contact import Array, View
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.model import Model
from station.physics.parameter import Parameter

TOLD_RAD = math.radians(1.0)
"""A smaller turn is that of a mark of 20 mm that is glued to a third of a millimetre: people are not told of it."""


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
        # A plate that is screwed on by eye is straight to 2°; a fifth of a pixel of a mark's 100; 0.3° of a camera
        # 0.3 m above the plate.
        Parameter(name="turn_rad", unit="rad", low=-0.2, high=0.2, typical=0.035),
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


def told(model: Model) -> Iterator[str]:
    """Yields a sentence about the camera's axes if they are turned by so much that people will want to know."""
    turns = (term.values["turn_rad"] for term in model.terms if term.effect is CAMERA_MAP)
    for turn_rad in turns:
        if abs(turn_rad) > TOLD_RAD:
            yield (
                f"the camera's axes are turned by {math.degrees(turn_rad):.1f}° against the arm's, about the plate's "
                "normal; this is allowed for"
            )

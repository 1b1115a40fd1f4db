"""A nuisance of every slide: the camera sees the plate a little turned about its normal, against the arm.

Nobody knows to a tenth of a degree where a camera's axes point, and by so much all blocks seem to slide beside the
steepest way down. Of a session of the simulated rig without any effect a push aside was told of 0.9 mrad (p = 2e-9):
its solver turns slides by up to that, more to one side or the other as the block lies.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import GRAVITY_M_S2, Array, Contact
from station.physics.effect import Effect, Family, Layer, Values, unit
from station.physics.parameter import Parameter


class CameraHeading(Effect):
    """The camera's axes are turned against the arm's."""

    id: ClassVar[str] = "_camera_heading"
    title: ClassVar[str] = "turn of the camera about the plate's normal"
    law: ClassVar[str] = "gravity seems to pull turn beside the arm's way down: a push g sin(tilt) turn to its left (0)"
    source: ClassVar[str] = "none: a nuisance of the measurement"
    layer: ClassVar[Layer] = "rig"
    family: ClassVar[Family] = "image"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        # A mark of 20 mm that is glued to 0.1 mm points to 0.3°.
        Parameter(name="turn_rad", unit="rad", low=-0.1, high=0.1, typical=0.005),
    )
    separated_by: ClassVar[str] = "nothing: it is allowed for"

    def push(self, contact: Contact, values: Values) -> Array | None:
        """The push (n, 3), m/s², in P."""
        size = values["turn_rad"] * GRAVITY_M_S2 * np.sin(contact.tilt_rad)
        return np.column_stack([unit(contact.down_rad + np.pi / 2) * size[:, None], np.zeros(len(contact))])


CAMERA_HEADING = CameraHeading()

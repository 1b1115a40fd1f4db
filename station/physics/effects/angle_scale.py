"""Scale of the angle: the arm reports (1 + g) times the true tilt, plus b.

The true tilt is (reported − b) / (1 + g), about the same axis. The coefficient takes it up entirely unless another
sensor saw the angle. That tells the scale, and the offset only from tilts in opposite directions, as the sensor itself
is turned on the plate by an unknown angle. Else the offset has its prior alone, and bounds so wide that it ends at none
of them (`python -m tests.proof --tier patch_world/single:36 --seed 20261540`, 025).
"""

from __future__ import annotations

from typing import ClassVar

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter


class AngleScale(Effect):
    """The reported tilt has a gain and an offset."""

    id: ClassVar[str] = "angle_scale"
    title: ClassVar[str] = "scale and offset of the angle"
    law: ClassVar[str] = "reported tilt = (1 + g) true + b (g = b = 0)"
    source: ClassVar[str] = "Dressel et al., section III.A and table I (reported against measured angles)"
    layer: ClassVar[Layer] = "rig"
    family: ClassVar[Family] = "level"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="gain", symbol="g", unit="1", low=-0.1, high=0.1, typical=0.01),
        Parameter(name="offset_rad", symbol="b", unit="rad", low=-0.2, high=0.2, typical=0.005),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("backlash", "adhesion")
    separated_by: ClassVar[str] = (
        "a second angle sensor on the plate, compared with the arm in opposite directions of the tilt"
    )
    absorbed_by_mu: ClassVar[bool] = True

    def attitude(self, contact: Contact, values: Values) -> Array | None:
        """Gives the plate's rotation vector (n, 3), rad, by the law of this module."""
        excess = (values["gain"] * contact.tilt_rad + values["offset_rad"]) / (1.0 + values["gain"])
        return -excess[:, None] * contact.tilt_axis

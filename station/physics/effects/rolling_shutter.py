"""Rolling shutter: the image's rows are exposed one after another, and a moving mark shears.

The row of the optical axis is read f T later than the frame's stamp says, and a corner in a row that is read t later
than that one, t = T (p − c)·down / image height, stands v t + a t² / 2 farther on, v and a its own velocity and
acceleration; p is where the picture shows it (`Model.seen`), and T the read-out time of an image that the tracking has
not allowed for. Drivers differ in the row whose time they stamp: f is 1/2 for the first
row, as libcamera has it, 0 for the middle one and −1/2 for the last. T is negative in a picture that was turned after
the read-out.
"""

from __future__ import annotations

from typing import ClassVar

from station.physics.contact import Array, View
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter


class RollingShutter(Effect):
    """Rows are exposed one after another."""

    id: ClassVar[str] = "rolling_shutter"
    title: ClassVar[str] = "rolling shutter"
    law: ClassVar[str] = "a row is seen T (row / rows - 1/2 + f) later than the stamp (T = 0)"
    source: ClassVar[str] = "Geyer, Meingast, Sastry 2005, OMNIVIS (geometric models of rolling-shutter cameras)"
    layer: ClassVar[Layer] = "camera"
    family: ClassVar[Family] = "image"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="readout_s", symbol="T", unit="s", low=-0.05, high=0.05, typical=0.005),
        Parameter(
            name="axis_later", symbol="f", unit="1", low=-0.5, high=0.5, typical=0.5, null=None, starts=(0.5, 0.0)
        ),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("viscous", "stribeck", "rate_strengthening")
    separated_by: ClassVar[str] = "the square's shape in motion: a shear that grows with the speed is the camera's"

    def delay_s(self, values: Values) -> float:
        """Gives minus the time from the stamp to the row of the optical axis, s: the stamps are early by that."""
        return -values["axis_later"] * values["readout_s"]

    def exposed_s(self, view: View, values: Values) -> Array | None:
        """Gives by how much later (n, 4), s, than the row of the optical axis the corners' rows are read."""
        return values["readout_s"] * ((view.point_m - view.image_centre_m) @ view.row_m) / view.image_size_m

    def seen(self, view: View, values: Values) -> Array | None:
        """Gives the displacement (n, 4, 2), m, of corners that are read in the rows where they are."""
        late_s = self.exposed_s(view, values)
        return None if late_s is None else view.later(late_s).point_m - view.point_m

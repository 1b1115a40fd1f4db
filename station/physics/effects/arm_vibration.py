"""Vibration: the arm shakes the plate, and a block close to its limit slips early, by an amount that scatters.

A shaken block starts near a peak of what pushes it down, and slides away while that lasts: onset and slide feel a mean
push, in proportion to the shaking. From run to run the push at the onset scatters as much (`EARLY`). Its standard
deviation is s (1 + c cos(descent) + d sin(descent)): some poses of the arm are softer than others. c and d are without
meaning while s = 0; alike in all poses (c = d = 0) the mean is hardly more than another mu.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values, unit
from station.physics.parameter import Parameter

EARLY = 1.0
"""Mean over standard deviation of the push at the onset.

Of a block that is shaken at 3 to 8 Hz while its slope grows by 3 to 14 °/s, the slide that gets away starts early by 0
to 1 standard deviations of the acceleration, and scatters by 0.2 to 0.7 of them: 1 is in the middle.
"""


class ArmVibration(Effect):
    """The plate shakes."""

    id: ClassVar[str] = "arm_vibration"
    title: ClassVar[str] = "vibration of the arm"
    law: ClassVar[str] = "push down the slope, mean s (1 + c cos + d sin of the descent), with as much scatter (s = 0)"
    source: ClassVar[str] = "Capozza et al. 2009, PRL 103, 085502 (vibration lowers the static threshold)"
    layer: ClassVar[Layer] = "rig"
    family: ClassVar[Family] = "timing"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="sd_m_s2", unit="m/s²", low=0.0, high=2.0, typical=0.1),
        # Nowhere to start from alike in all poses: that would be tried as what mu absorbs.
        Parameter(name="cos1", unit="1", low=-0.7, high=0.7, typical=0.3, null=None, starts=(0.6, -0.6)),
        Parameter(name="sin1", unit="1", low=-0.7, high=0.7, typical=0.3, null=None, starts=(0.0, 0.6, -0.6)),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("pivot_offset", "one_way_friction", "plate_anisotropy")
    separated_by: ClassVar[str] = "the same tilts from other poses of the arm, or an IMU on the plate"

    def push(self, contact: Contact, values: Values) -> Array | None:
        """The mean, see the module."""
        mean = EARLY * np.broadcast_to(self.shaking(contact, values), contact.down_rad.shape)
        return np.column_stack([mean[:, None] * unit(contact.down_rad), np.zeros(len(contact))])

    def shaking(self, contact: Contact, values: Values) -> Array | float:
        """See the module."""
        wave = values["cos1"] * np.cos(contact.down_rad) + values["sin1"] * np.sin(contact.down_rad)
        return values["sd_m_s2"] * (1.0 + wave)

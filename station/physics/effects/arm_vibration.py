"""Vibration: the arm shakes the plate, and a block close to its limit slips early, by an amount that scatters.

A shaken block starts near a peak, so the push at the onset has a mean (`EARLY` standard deviations), which lowers the
onset in proportion to the shaking; its scatter adds to the runs' in the square. The standard deviation is
s (1 + c cos(descent) + d sin(descent)): some poses of the arm are softer than others. c and d are without meaning while
s = 0; alike in all poses (c = d = 0) the mean is nothing but another mu.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter


class ArmVibration(Effect):
    """The plate shakes."""

    id: ClassVar[str] = "arm_vibration"
    title: ClassVar[str] = "vibration of the arm"
    law: ClassVar[str] = (
        "push down the slope at the onset, sd s (1 + c cos + d sin of the descent), mean as large (s = 0)"
    )
    source: ClassVar[str] = "Capozza et al. 2009, PRL 103, 085502 (vibration lowers the static threshold)"
    layer: ClassVar[Layer] = "rig"
    family: ClassVar[Family] = "timing"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="sd_m_s2", unit="m/s²", low=0.0, high=2.0, typical=0.1),
        Parameter(name="cos1", unit="1", low=-0.7, high=0.7, typical=0.3, null=None, starts=(0.0, 0.6, -0.6)),
        Parameter(name="sin1", unit="1", low=-0.7, high=0.7, typical=0.3, null=None, starts=(0.0, 0.6, -0.6)),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("pivot_offset", "one_way_friction", "plate_anisotropy")
    separated_by: ClassVar[str] = "the same tilts from other poses of the arm, or an IMU on the plate"

    def shaking(self, contact: Contact, values: Values) -> Array | float:
        """See the module."""
        wave = values["cos1"] * np.cos(contact.down_rad) + values["sin1"] * np.sin(contact.down_rad)
        return values["sd_m_s2"] * (1.0 + wave)

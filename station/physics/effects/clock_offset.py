"""Clock offset: the camera's stamps read late (or early) against the arm's.

A stamp reads t + τ for what was seen at t: an onset then seems to come τ · rate too high.
"""

from __future__ import annotations

from typing import ClassVar

from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter

EARLIEST_S = -2e-3
"""Buffers, exposure and networks make stamps late. Early they can only be by what is wrong with the comparison of the
clocks, which is less than half a round trip."""


class ClockOffset(Effect):
    """The camera's clock is off."""

    id: ClassVar[str] = "clock_offset"
    title: ClassVar[str] = "offset between the clocks"
    law: ClassVar[str] = "camera stamps read t + tau (tau = 0)"
    source: ClassVar[str] = "Furgale, Rehder, Siegwart 2013, IROS, 1280 (time offsets between sensors)"
    layer: ClassVar[Layer] = "rig"
    family: ClassVar[Family] = "timing"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="delay_s", unit="s", low=EARLIEST_S, high=0.3, typical=0.02),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("backlash", "contact_aging", "kinetic_drop", "rate_strengthening")
    separated_by: ClassVar[str] = (
        "tilt rates from slow to fast in random order; fixed fiducials that move with the attitude"
    )

    def delay_s(self, values: Values) -> float:
        """See the module."""
        return values["delay_s"]

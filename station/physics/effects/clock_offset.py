"""Clock offset: the camera's stamps read late (or early) against the arm's.

A stamp reads t + τ for what was seen at t, and the plate's attitude is sought τ too late: an onset seems to come
τ · rate too high, and a path is compared with another pull. Buffers, exposure and networks make the camera's stamps
late (τ > 0). Those that make the arm's stamps late (a controller that reports what it filtered, a driver that stamps on
receipt) let the camera's read early (τ < 0), by as much. Another angle sensor tells whose stamps are off: it differs
from the arm's angle by the share `of_arm` of τ times the tilt's rate.
"""

from __future__ import annotations

from typing import ClassVar

from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter

FARTHEST_S = 0.3
"""The largest offset either way: half as much again as the longest that is known of (0.2 s)."""

LATE_S = 0.1
"""A delay that is looked at as it is: within it a plate begins to return, which no slope at no delay knows. Without it
0.11 s (the second generator's early_stamps, seed 20261512) was called something without a name, with mu at a quarter.
"""


class ClockOffset(Effect):
    """The camera's clock is off."""

    id: ClassVar[str] = "clock_offset"
    title: ClassVar[str] = "offset between the clocks"
    law: ClassVar[str] = "camera stamps read t + tau (tau = 0)"
    source: ClassVar[str] = "Furgale, Rehder, Siegwart 2013, IROS, 1280 (time offsets between sensors)"
    layer: ClassVar[Layer] = "rig"
    family: ClassVar[Family] = "timing"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="delay_s",
            symbol="tau",
            unit="s",
            low=-FARTHEST_S,
            high=FARTHEST_S,
            typical=0.02,
            sizes=(-LATE_S, LATE_S),
        ),
        Parameter(name="of_arm", unit="1", low=0.0, high=1.0, typical=1.0, null=None, starts=(0.0, 1.0)),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("backlash", "contact_aging", "kinetic_drop", "rate_strengthening")
    separated_by: ClassVar[str] = (
        "tilt rates from slow to fast in random order; fixed fiducials that move with the attitude"
    )

    def delay_s(self, values: Values) -> float:
        """Gives the delay of the camera's stamps, s."""
        return values["delay_s"]

    def arm_delay_s(self, values: Values) -> float:
        """Gives the part of it that is the arm's, s."""
        return values["of_arm"] * values["delay_s"]

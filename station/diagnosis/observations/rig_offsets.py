"""The offsets of a rig with which slips are read: the lateness of its frames' stamps, and where its plate turns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from station.diagnosis.observations.early import GRID_S
from station.physics.contact import Array
from station.physics.model import Model

NEAR_M = 0.01
"""An arm that is off by less pushes a block by less than a per cent of its limit as a step of the tilt begins (2 to 3
rad/s² of 3 m/s²; `pytest tests/unit/diagnosis/test_nearness.py -k "jerks or again"`)."""


@dataclass(frozen=True, eq=False)
class RigOffsets:
    """`late_s` is how late frames are stamped; `arm_m` (3,), m in P, is from the true pivot to the configured one.

    Without an arm the blocks' first paths say which one is likeliest.
    """

    late_s: float = 0.0
    arm_m: Array | None = None

    @classmethod
    def of(cls, model: Model) -> RigOffsets:
        """Returns the offsets of a fitted model's clock and pivot."""
        arm_m = model.arm_m()
        return cls(model.delay_s(), arm_m if arm_m.any() else None)

    def is_near(self, other: RigOffsets) -> bool:
        """Returns true if slips read with the other's offsets are as good as those that are read with these."""
        apart_m = 0.0 if self.arm_m is None or other.arm_m is None else float(np.abs(self.arm_m - other.arm_m).max())
        # Slips are sought at every GRID_S.
        return abs(self.late_s - other.late_s) <= GRID_S and apart_m <= NEAR_M


UNKNOWN_OFFSETS = RigOffsets()
"""Stamps count as punctual, and the pivot is where the blocks' first paths show it."""

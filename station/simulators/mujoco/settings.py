"""The twin's part of a rig file: the material pair, changes to it, block and plate."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from station.simulators.mujoco.pairs import load_pair
from station.simulators.mujoco.specimen import Block, FixedIn, Friction, Plate


@dataclass(frozen=True, kw_only=True)
class TwinSettings:
    """The material pair, block and plate on the simulated arm.

    `pair` is the name of a preset or the path of a pair's file; each of the other friction keys replaces the pair's
    value. The mean is given as an angle or as a coefficient (mu = tan of the angle), not as both.
    """

    pair: str = "steel_on_steel"
    mean_angle_rad: float | None = None
    mean_mu: float | None = None
    scatter: float | None = None
    ratio: float | None = None
    axis_rad: float | None = None
    fixed_in: FixedIn | None = None
    block: Block = field(default_factory=Block)
    plate: Plate = field(default_factory=Plate)

    def __post_init__(self) -> None:
        """Refuses, by a ValueError, two means."""
        if self.mean_angle_rad is not None and self.mean_mu is not None:
            raise ValueError("give mean_angle_rad or mean_mu, not both")
        self.friction()

    def friction(self) -> Friction:
        """Returns the pair's friction with the changes made.

        Raises:
            UserError: if the pair is not known.
            ValueError: if a change is not possible friction.
        """
        angle = math.atan(self.mean_mu) if self.mean_mu is not None else self.mean_angle_rad
        changes = {"mean_angle_rad": angle, "scatter": self.scatter, "ratio": self.ratio}
        changes |= {"axis_rad": self.axis_rad, "fixed_in": self.fixed_in}
        return replace(load_pair(self.pair), **{key: value for key, value in changes.items() if value is not None})  # pyright: ignore[reportArgumentType] (each value has its own field's type)

"""Laws of friction and pushes of our own, for the twin's world: each vanishes with its one strength at 0.

They are the laws of tests/concealed (README.md there), written once more for a world that is stepped by MuJoCo.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from station.simulators.mujoco.influence import BlockState


class _OfFriction:
    """A mechanism without a push."""

    def push(self, state: BlockState) -> tuple[float, float]:
        """None."""
        del state
        return 0.0, 0.0


@dataclass(frozen=True)
class KineticDrop(_OfFriction):
    """Lowers friction in motion by the share `drop`, at once."""

    drop: float

    def friction(self, state: BlockState) -> float:
        """See `Influence.friction`."""
        return 1.0 - self.drop if state.sliding else 1.0


@dataclass(frozen=True)
class Drag:
    """A force against the motion, `drag_per_s` times the velocity, per mass."""

    drag_per_s: float

    def friction(self, state: BlockState) -> float:
        """Friction as it was."""
        del state
        return 1.0

    def push(self, state: BlockState) -> tuple[float, float]:
        """See `Influence.push`."""
        return -self.drag_per_s * state.velocity_m_s[0], -self.drag_per_s * state.velocity_m_s[1]


@dataclass(frozen=True)
class Wear(_OfFriction):
    """Friction falls with the slides n that have been: 1 − w (1 − exp(−n/n0))."""

    wear: float
    wear_runs: float

    def friction(self, state: BlockState) -> float:
        """See `Influence.friction`."""
        return 1.0 - self.wear * (1.0 - math.exp(-state.slides / self.wear_runs))


@dataclass(frozen=True)
class Ageing(_OfFriction):
    """A lying block's friction grows by `ageing` a decade of its time; in motion it is that of a contact 1 s old."""

    ageing: float
    cutoff_s: float

    def friction(self, state: BlockState) -> float:
        """See `Influence.friction`."""
        if state.sliding:
            return 1.0
        return 1.0 + self.ageing * math.log10((state.lain_s + self.cutoff_s) / (1.0 + self.cutoff_s))


@dataclass(frozen=True)
class Patch(_OfFriction):
    """One round spot of the plate: friction is more (or less) by the share `patch` in its middle."""

    patch: float
    x_m: float
    y_m: float
    radius_m: float

    def friction(self, state: BlockState) -> float:
        """See `Influence.friction`."""
        away = math.hypot(state.place_m[0] - self.x_m, state.place_m[1] - self.y_m) / self.radius_m
        return 1.0 + self.patch * math.exp(-0.5 * away * away)

"""Mechanisms of a twin's world beyond friction drawn for each contact: laws of friction, and pushes, of the caller.

The twin itself has none. A test or a study that wants a world with a further mechanism hands one to `TwinWorld`, which
asks it before every step of a block that can move, and at every look at one that is a part of the plate.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

from station.simulators.mujoco.specimen import FrictionDraw

SLIDES_M_S, GROWING = 3e-4, 5
"""A slide is faster than this, and began with so many steps (10 ms) of growing speed.

A block that is laid down by contact sinks in and slips at up to 4 mm/s, ever more slowly; below its limit it creeps at
0.03 mm/s. Neither is a slide.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockState:
    """A block in the plate's frame: place (m), velocity (m/s); whether it slides, and how long it has lain since (s).

    `slides` is how many it has ended.
    """

    place_m: tuple[float, float]
    velocity_m_s: tuple[float, float]
    sliding: bool
    lain_s: float
    slides: int


class Slides:
    """Detects from a block's speed, step by step, whether it slides."""

    def __init__(self) -> None:
        self.now = False
        self._speed_m_s, self._growing = 0.0, 0

    def take(self, speed_m_s: float) -> bool:
        """Takes the next step's speed."""
        self._growing = self._growing + 1 if speed_m_s > self._speed_m_s else 0
        self._speed_m_s = speed_m_s
        self.now = speed_m_s > SLIDES_M_S and (self.now or self._growing >= GROWING)
        return self.now


class Influence(Protocol):
    """A mechanism. A block that lies must not lose friction by lying on: it is asked about ever less often."""

    def friction(self, state: BlockState) -> float:
        """Returns the factor on the contact's friction in that state."""
        ...

    def push(self, state: BlockState) -> tuple[float, float]:
        """Returns a further acceleration along the plate (m/s², plate frame); none at rest."""
        ...


def times(draw: FrictionDraw, factor: float) -> FrictionDraw:
    """Returns a contact's friction multiplied by a factor in every direction."""
    return replace(draw, mu=draw.mu * factor, mu_along=draw.mu_along * factor, mu_across=draw.mu_across * factor)

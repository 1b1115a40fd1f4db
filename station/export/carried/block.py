"""A block on a plate in plain NumPy: the smallest simulator for a model."""

from __future__ import annotations

import math

import numpy as np

from station.export.carried.law import Law
from station.export.carried.watch import Moment
from station.physics.contact import Array
from station.physics.sole import SQUARE_GYRATION, TURNING_RADIUS

_ROUNDS = 50
"""Halvings of the interval of a speed: to the last bit."""


class Block:
    """A block at `place` (x, y, yaw), which a law moves, in steps of `step_s`."""

    def __init__(self, law: Law, *, step_s: float = 1e-3, side_m: float = 0.01) -> None:
        """The block lies in the plate's middle."""
        self.law, self.step_s, self.side_m = law, step_s, side_m
        self.time_s, self.place, self.velocity = 0.0, np.zeros(3), np.zeros(3)

    def advance(self, gravity: Array) -> Array:
        """Takes one step under gravity (3,), m/s², in the plate's frame.

        It returns the place (3,), m and rad, after it.
        """
        now = Moment(self.time_s, gravity, self.place, self.velocity)
        action = self.law.act(now, step_s=self.step_s)
        reach = TURNING_RADIUS * self.side_m
        mass = np.array([1.0, 1.0, SQUARE_GYRATION / TURNING_RADIUS**2])
        pulled = gravity[:2] + action.force[:2]
        driven = np.array([*(self.velocity[:2] + self.step_s * pulled), self._spun(reach, action.turn)])
        slowed = _after_friction(driven, mass, self.step_s * action.mu * action.normal)
        self.velocity = slowed / np.array([1.0, 1.0, reach])
        self.place = self.place + self.step_s * self.velocity
        if not action.moving and self.law.model.acting("creep"):
            self.place = self.place + self.step_s * np.append(self.law.creep(), 0.0)
        self.time_s += self.step_s
        return self.place

    def _spun(self, reach: float, turn: float) -> float:
        return reach * (float(self.velocity[2]) + self.step_s * turn)


def _after_friction(velocity: Array, mass: Array, most: float) -> Array:
    """Gives the velocity (3,), of which the last is that of the sole's rim, after friction's impulse of at most `most`.

    Friction opposes the velocity that it leaves behind: v = v₀ − most v / (mass |v|), or 0 where it can stop the block.
    """
    if math.hypot(*(mass * velocity)) <= most:
        return np.zeros(3)
    low, high = 0.0, math.hypot(*velocity)
    for _ in range(_ROUNDS):
        speed = 0.5 * (low + high)
        left = velocity * mass * speed / (mass * speed + most)
        low, high = (speed, high) if math.hypot(*left) > speed else (low, speed)
    return velocity * mass * high / (mass * high + most)

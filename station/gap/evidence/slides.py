"""The sliding channels: friction along the motion, across it, and the turning of the block, window by window."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from station.gap.evidence.channel import Channel, Rows
from station.gap.evidence.moments import Moments
from station.gap.evidence.windows import WEIGHTS
from station.physics.contact import Array
from station.physics.dissipation import support
from station.physics.model import Model


@dataclass(frozen=True, eq=False)
class Motion:
    """The windows' accelerations (n, 2), m/s², and angular accelerations (n,); states at the nodes (3 n moments)."""

    moments: Moments
    acceleration_m_s2: Array
    yaw_acceleration_rad_s2: Array


class _Slides(Channel):
    phase: ClassVar[str] = "slide"

    def __init__(self, rows: Rows, motion: Motion) -> None:
        super().__init__(rows)
        self.motion = motion

    def _mean(self, values: Array) -> Array:
        """Over the nodes of each window, with the weak form's weights: (3 n, …) to (n, …)."""
        return np.tensordot(values.reshape(len(self), len(WEIGHTS), *values.shape[1:]), WEIGHTS, axes=([1], [0]))


class Along(_Slides):
    """Friction along the motion, relative: (pull − acceleration − N h) / (N mu)."""

    name: ClassVar[str] = "along"
    unit: ClassVar[str] = "relative friction"
    shares_friction: ClassVar[bool] = True

    def residual(self, model: Model) -> Array:
        """See the class."""
        load = self.motion.moments.loads(model)
        way = np.column_stack([np.cos(load.contact.way_rad), np.sin(load.contact.way_rad)])
        pull = self._mean((load.tangential * way).sum(axis=1) - load.normal * model.friction(load.contact))
        gained = (self.motion.acceleration_m_s2 * _unit(self._mean(way))).sum(axis=1)
        return (pull - gained) / (self._mean(load.normal) * model.mu_s)


class Across(_Slides):
    """Sideways force, relative: (pull − acceleration − N h′) / (N mu), to the left of the motion."""

    name: ClassVar[str] = "across"
    unit: ClassVar[str] = "relative friction"

    def residual(self, model: Model) -> Array:
        """See the class."""
        load = self.motion.moments.loads(model)
        angle = load.contact.way_rad
        left = np.column_stack([-np.sin(angle), np.cos(angle)])
        _, slope, _ = support(model, load.contact, angle)
        pull = self._mean((load.tangential * left).sum(axis=1) - load.normal * slope)
        gained = (self.motion.acceleration_m_s2 * _unit(self._mean(left))).sum(axis=1)
        return (pull - gained) / (self._mean(load.normal) * model.mu_s)


class Turn(_Slides):
    """Angular acceleration of the sliding block, rad/s²."""

    name: ClassVar[str] = "turn"
    unit: ClassVar[str] = "rad/s²"

    def residual(self, model: Model) -> Array:
        """See the class."""
        predicted = model.spin(self.motion.moments.reported)
        return self.motion.yaw_acceleration_rad_s2 - self._mean(np.broadcast_to(predicted, len(self.motion.moments)))


def _unit(vectors: Array) -> Array:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12)

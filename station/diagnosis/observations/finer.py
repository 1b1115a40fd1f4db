"""Gives whole windows what a model's own motion of the plate does in them, at more moments than their nodes.

A plate that takes up the play of a reversal is set in motion within a few milliseconds; the three nodes of a window are
some 30 ms apart and would see all of that or nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from station.diagnosis.observations.moments import Moments
from station.diagnosis.observations.windows import WEIGHTS
from station.physics.contact import Array
from station.physics.model import Model


@dataclass(frozen=True, eq=False)
class Finer:
    """`moments` at the n windows' FINE_NODES (41 n), and the weights (n, 41) of their means."""

    moments: Moments
    weight: Array

    def evened(self, model: Model, acceleration_rad_s2: Array) -> Array:
        """Returns accelerations of the same shape, with the means over the windows that the model has.

        Args:
            model: the model.
            acceleration_rad_s2: (m, 3) the plate's own accelerations at the m = 3 n nodes, rad/s², in P.
        """
        _, finer = model.motion(self.moments.standing(model))
        windows, at_nodes = len(self.weight), acceleration_rad_s2.reshape(-1, len(WEIGHTS), 3)
        mean = (finer.reshape(windows, -1, 3) * self.weight[..., None]).sum(axis=1)
        missed = mean - (at_nodes * WEIGHTS[:, None]).sum(axis=1)
        return acceleration_rad_s2 + np.repeat(missed, len(WEIGHTS), axis=0)

"""Gives whole windows what a model's own motion of the plate does in them, at more moments than their nodes.

A plate that takes up the play of a reversal is set in motion within a few milliseconds; the three nodes of a window are
some 30 ms apart and would see all of that or nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from station.diagnosis.observations.moments import Moments
from station.diagnosis.observations.windows import WEIGHTS
from station.physics.contact import Array
from station.physics.model import Model


@dataclass(frozen=True, eq=False)
class Finer:
    """The weights (n, 41) of means over n windows, and what makes the moments at their FINE_NODES (41 n).

    Few models move the plate themselves: the moments are made for the first that does.
    """

    make: Callable[[], Moments]
    weight: Array

    @cached_property
    def moments(self) -> Moments:
        """The moments (41 n)."""
        return self.make()

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

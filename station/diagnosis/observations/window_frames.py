"""Gives whole windows what a model's own motion of the plate does in them, at all frames and not at their nodes alone.

A plate that takes up the play of a reversal is set in motion within a few milliseconds; the three nodes of a window are
some 30 ms apart and would see all of that or nothing. A window's acceleration is the curvature of a parabola through
its frames, so what the plate's own motion adds to it is that of the plate's turns at these very frames, however jerky.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from station.diagnosis.observations.moments import Moments
from station.diagnosis.observations.windows import WEIGHTS
from station.physics.contact import Array
from station.physics.model import Model


@dataclass(frozen=True, eq=False)
class WindowFrames:
    """The weights of the frames (n, k), 1/s², that give the curvature in n windows, and what makes their moments (n k).

    Few models move the plate themselves: the moments are made for the first that does.
    """

    make: Callable[[], Moments]
    curvature: Array

    @cached_property
    def moments(self) -> Moments:
        """The moments (n k)."""
        return self.make()

    def evened(self, model: Model) -> Array:
        """Returns the mean acceleration (3 n, 3), rad/s², in P, that a model's own motion adds to its window's."""
        moving = replace(model, terms=model.acting("motion"))
        turn_rad = moving.attitude(self.moments.standing(model)).reshape(*self.curvature.shape, 3)
        return np.repeat((self.curvature[..., None] * turn_rad).sum(axis=1), len(WEIGHTS), axis=0)

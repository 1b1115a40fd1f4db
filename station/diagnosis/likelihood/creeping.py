"""A nuisance of every block that rests near its limit: it creeps there, for reasons that nobody tells.

All such reasons move it down the slope and grow by e-folds towards the limit (`observations.nearness`), so that their
mean is none of a noise. Taken for noise around 0 it spoke for every law of which a block creeps: a shaking arm beside
the soft sole of an opened case gained 67 nats of it (`pytest tests/unit/diagnosis/test_creeping.py`).
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, View
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter


class NearLimit(Effect):
    """A block near its limit has crept down the slope."""

    id: ClassVar[str] = "_near_limit"
    strains: ClassVar[bool] = False
    title: ClassVar[str] = "creep near the limit"
    law: ClassVar[str] = "the block lies share of the way down the slope that it may have crept (share = 0)"
    source: ClassVar[str] = "Marone 1998, Annu. Rev. Earth Planet. Sci. 26, 643, and others, see observations.nearness"
    layer: ClassVar[Layer] = "rig"
    family: ClassVar[Family] = "image"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        # All of it is the most that the noise allows for, too.
        Parameter(name="share", unit="1", low=0.0, high=1.0, typical=1.0),
    )
    separated_by: ClassVar[str] = "nothing: it is allowed for"

    def seen(self, view: View, values: Values) -> Array | None:
        """Returns the block mark's shift (n, points, 2) down the slope, m; None for other marks."""
        if not view.on_block:
            return None
        shift = values["share"] * np.broadcast_to(view.crept_m, len(view.down))[:, None] * view.down
        return view.shifted(shift)


NEAR_LIMIT = NearLimit()

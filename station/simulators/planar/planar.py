"""One tilt in the fast planar simulator, in the words of the exact slider."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from station.simulators.planar import kernel
from station.simulators.slider import GRAVITY, LimitCurve, Slide, Tilt

FLOATS = NDArray[np.float64]


def simulate(
    tilt: Tilt,
    curve: LimitCurve,
    *,
    start_m: Sequence[float] = (0.0, 0.0),
    output_s: float = 0.01,
    gravity: float = GRAVITY,
) -> Slide:
    """Follows a block that rests at `start_m` (m, plate frame) through the whole tilt.

    The same as `station.simulators.slider.simulate`, thousands of times faster, and to some nanometres the same path.
    The profile's time begins at 0 or later; the path is sampled at the multiples of `output_s`.
    """
    times = np.arange(0.0, tilt.time_s[-1], output_s)
    path, turn = np.empty((len(times), 4)), curve.turn
    knots = np.column_stack([tilt.time_s, tilt.angle_rad])
    (along, across), (square, other) = (turn @ tilt.slope).tolist(), (curve.mu**2).tolist()
    start: FLOATS = turn @ np.array(start_m, dtype=np.float64)
    onset_s, onset_rad = kernel.tilt(knots, (along, across, square, other, gravity), start, output_s, path)
    return Slide(float(onset_s), float(onset_rad), times, path[:, :2] @ turn, path[:, 2:] @ turn)

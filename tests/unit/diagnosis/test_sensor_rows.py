"""The readings of another angle sensor by which a stretch of a run is compared."""

import numpy as np
import pytest

from station.diagnosis.observations.marks import SENSOR_POINTS
from station.diagnosis.observations.sensor_rows import _spread  # pyright: ignore[reportPrivateUsage]


@pytest.mark.parametrize("count", [SENSOR_POINTS, 40, 113])
def test_the_chosen_readings_of_a_stretch_have_the_mean_of_all(count: int):
    """A step of 2° in the middle of a stretch: a late clock is told by such means to a thousandth of a degree."""
    place = (np.arange(count) + 0.5) / count
    angle_deg = 2.0 * np.clip((place - 0.3) / 0.4, 0.0, 1.0)
    assert angle_deg[_spread(np.arange(count))].mean() == pytest.approx(angle_deg.mean(), abs=0.01)


def test_a_stretch_of_few_readings_repeats_them_evenly():
    chosen = _spread(np.array([7, 8, 9]))
    assert (np.bincount(chosen)[7:] == SENSOR_POINTS // 3).all()

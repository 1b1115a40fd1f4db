"""The moment at which the load comes to exceed friction, of runs that are stepped together."""

from __future__ import annotations

import numpy as np
import pytest

from station.physics.contact import Array
from station.simulators.mujoco.following import Followed, weigh

STEP_S = 0.001


def followed(surplus: list[float], over_from_s: list[float]) -> Followed:
    """Runs at 1 s with what was noted at the step before."""
    count = len(surplus)
    none, index = np.zeros(count), np.arange(count)
    return Followed(
        row=index,
        number=index,
        time_s=np.full(count, 1.0),
        step_s=np.full(count, STEP_S),
        pose=np.zeros((count, 3)),
        rates=np.zeros((count, 3)),
        way=none,
        slid_from_s=none,
        rest_from_s=none,
        since_s=none,
        surplus=np.array(surplus),
        over_from_s=np.array(over_from_s),
        from_position=np.zeros((count, 2)),
        bodies=[],
    )


def noted(now: Array, *, before: list[float], over_from_s: list[float]) -> list[float]:
    """The times that are noted for these shares of friction that are left."""
    runs = followed(before, over_from_s)
    weigh(runs, now)
    np.testing.assert_array_equal(runs.surplus, now)
    return runs.over_from_s.tolist()


def test_the_load_exceeds_friction_from_the_zero_between_two_steps() -> None:
    found = noted(np.array([-0.1, -0.1, 0.2]), before=[0.3, np.nan, -0.1], over_from_s=[np.inf, np.inf, 0.5])
    assert found == [pytest.approx(1.0 - 0.25 * STEP_S), 1.0, np.inf]


@pytest.mark.filterwarnings("error")
def test_a_block_that_nothing_holds_is_weighed_without_a_warning() -> None:
    """The plate falls away from under it: the pull is then divided by next to nothing."""
    found = noted(np.array([1e12, -1e12, -1e12]), before=[1e12, 1e12, -1e12], over_from_s=[np.inf, np.inf, 0.5])
    assert found == [np.inf, pytest.approx(1.0 - 0.5 * STEP_S), 0.5]

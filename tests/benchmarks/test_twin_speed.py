"""The twin's time for a second of a session is measured; run with `pytest -m benchmark -s`.

CPU time of this thread, the least of three repeats, because wall time on a shared machine measures the neighbours.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import numpy as np
import pytest

from station.simulators.mujoco.pairs import load_pair
from tests.unit.simulators.rides import arm_world, jaco, ride, settle, steps

Repeat = Callable[[], tuple[float, float]]


@pytest.mark.benchmark
@pytest.mark.parametrize("pair", ["steel_on_steel", "wood_on_steel", "wood_on_wood"])
@pytest.mark.parametrize("savings", [True, False])
def test_cpu_time_per_simulated_second(pair: str, savings: bool) -> None:
    tilter = jaco()

    def one_run() -> tuple[float, float]:
        world = arm_world(tilter, load_pair(pair), seed=2, savings=savings)
        settle(world, seconds=1.0)
        profile = steps(math.radians(1.35), rate_rad_s=math.radians(5), hold_s=0.1)
        begin = time.thread_time()
        seen = ride(world, profile, seconds=20, tilter=tilter, stop_m=3e-3)
        return time.thread_time() - begin, float(seen.time_s[-1])

    repeats = [one_run() for _ in range(3)]
    cost = min(spent / lasted for spent, lasted in repeats) * 1e3
    print(f"\n{pair}, savings {savings}: {cost:.2f} ms of CPU for a simulated second, the test's own driving included")
    assert np.isfinite(cost)

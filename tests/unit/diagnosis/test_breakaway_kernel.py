"""The moments of a run are followed side by side, and none of them feels the others."""

from __future__ import annotations

import numpy as np
import pytest

from shared.geometry import Array
from station.diagnosis.observations.breakaway_marginal import log_likelihoods
from station.diagnosis.observations.breakaway_tables import COUNT, STEP_S, Laws, Rows, cubics

FIRST_S, FRAMES, NODES = -0.4, 80, 400


def grid_point_s(number: float) -> float:
    return FIRST_S + number * STEP_S


def one_run(frame_s: float) -> Rows:
    """A run with frames every 10 ms and one more at a given time."""
    time = np.sort(np.array([*(FIRST_S + STEP_S + 0.0101 * np.arange(FRAMES)), frame_s], dtype=np.float64))
    path = 0.3 * np.square(np.maximum(time - frame_s, 0.0))
    pull, press = np.linspace(3.0, 3.4, NODES), np.full(NODES, 9.0)
    sine, sigma = np.full_like(time, 0.3), np.array([1e-4])
    return Rows(
        np.array([FIRST_S]), pull[None], press[None], np.array([len(time)]), time[None], path[None], sine[None], sigma
    )


LAW = Laws(
    held=cubics(np.full(COUNT, 0.8))[None],
    slowing_m_s2=cubics(np.zeros(COUNT))[None],
    of_run=np.zeros(1, dtype=np.int64),
    spread=0.05,
    creep_m=1e-5,
)


def log_of(rows: Rows, *moments: float) -> Array:
    return log_likelihoods(np.array([moments]), rows, LAW)[0]


@pytest.mark.parametrize("number", range(40, 60))
@pytest.mark.parametrize("side", [-1.0, 0.0, 1.0])
def test_a_moment_beside_others_is_as_likely_as_alone(number: int, side: float) -> None:
    """A moment within the last bit of a grid point at which a frame stands belongs to one step, not to none."""
    after = grid_point_s(number)
    moment = after if side == 0.0 else float(np.nextafter(after, side * np.inf))
    rows = one_run(after)
    alone, beside = log_of(rows, moment), log_of(rows, grid_point_s(number - 6.5), moment)
    assert beside[1] == alone[0]
    assert alone[0] == pytest.approx(log_of(rows, moment - 1e-9)[0], abs=1e-3)

"""How many 3-second tilts a second the planar simulator does on one core; run with `pytest -m benchmark -s`."""

from __future__ import annotations

import time

import numpy as np
import pytest

from station.simulators.planar import kernel


@pytest.mark.benchmark
@pytest.mark.parametrize("across", [0.45, 0.35], ids=["circle", "ellipse"])
def test_tilts_per_second(across: float) -> None:
    knots = np.array([[0.0, 0.25], [2.5, 0.45], [3.0, 0.1]])
    law, start, path = (0.6, -0.8, 0.45**2, across**2, 9.81), np.zeros(2), np.empty((300, 4))
    rates = []
    for _ in range(5):
        begin = time.thread_time()
        for _ in range(1000):
            kernel.tilt(knots, law, start, 0.01, path)
        rates.append(1000 / (time.thread_time() - begin))
    moved = float(np.linalg.norm(path[-1, :2]))
    print(f"\n{max(rates):.0f} tilts of 3 s a second of CPU, each with a slide of {moved * 1e3:.1f} mm")
    assert moved > 0

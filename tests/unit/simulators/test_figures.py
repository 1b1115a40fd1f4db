"""The figures that sum up errors."""

from __future__ import annotations

import math

import numpy as np
import pytest

from station.simulators.figures import mean, median, rms, trimmed_rms


def test_one_lost_block_moves_the_plain_figure_and_not_the_robust_ones() -> None:
    rng = np.random.default_rng(1)
    good = rng.normal(0.0, 1.0, 60)
    spoilt = np.append(good, 50.0)
    assert rms(spoilt).value > 5.0 * rms(good).value
    for robust in (trimmed_rms, median):
        assert robust(np.abs(spoilt)).value == pytest.approx(robust(np.abs(good)).value, rel=0.15)


def test_their_standard_errors_are_the_scatter_of_repeats() -> None:
    rng = np.random.default_rng(2)
    draws = [rng.normal(0.5, 1.0, 60) for _ in range(400)]
    for figure in (mean, rms, median):
        found = [figure(draw) for draw in draws]
        scatter = float(np.std([one.value for one in found]))
        assert float(np.mean([one.sd for one in found])) == pytest.approx(scatter, rel=0.2)


def test_nothing_to_sum_up_is_no_number() -> None:
    for figure in (mean, rms, median, trimmed_rms):
        assert math.isnan(figure(np.full(3, np.nan)).value)

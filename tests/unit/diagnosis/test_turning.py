"""The rates at which sliding blocks turn, as expected from noisy ones."""

from __future__ import annotations

import numpy as np
import pytest

from station.diagnosis.observations.turning import expected_rates
from station.physics.contact import Array

STRETCHES, SIGMA = 2000, 0.3


def seen(own_rad_s: float) -> tuple[Array, Array, Array]:
    """The true rates (n,), and the expected ones (n, 3) with their errors (n,), rad/s."""
    rng = np.random.default_rng(20261150)
    true = rng.normal(0.0, own_rad_s, STRETCHES)
    measured = true + rng.normal(0.0, SIGMA, STRETCHES)
    expected, error = expected_rates(np.repeat(measured[:, None], 3, axis=1), np.full(STRETCHES, SIGMA))
    return true, expected, error


@pytest.mark.parametrize("own_rad_s", [0.2, 1.0])
def test_true_rates_are_as_large_as_expected(own_rad_s: float) -> None:
    """A regression of the true rates on the expected ones has slope 1; on the measured ones it is smaller."""
    true, expected, error = seen(own_rad_s)
    middle = expected[:, 1]
    assert float(true @ middle / (middle @ middle)) == pytest.approx(1.0, abs=0.1)
    assert float(np.std(true - middle)) == pytest.approx(float(error[0]), rel=0.1)


def test_blocks_that_do_not_turn_are_not_expected_to() -> None:
    _, expected, error = seen(0.0)
    assert np.abs(expected).max() < 0.1 * SIGMA
    assert error.max() < 0.3 * SIGMA


def test_without_stretches_nothing_is_expected() -> None:
    expected, error = expected_rates(np.zeros((0, 3)), np.zeros(0))
    assert expected.shape == (0, 3)
    assert error.shape == (0,)

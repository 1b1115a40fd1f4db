"""The rates at which sliding blocks turn, as expected from noisy ones."""

from __future__ import annotations

import numpy as np
import pytest

from station.diagnosis.observations.turning import expected_rates
from station.physics.contact import Array

STRETCHES, SIGMA, OF_A_RUN = 2000, 0.3, 5


def seen(own_rad_m: float, *, of_slides: float = 0.0) -> tuple[Array, Array, Array]:
    """The true rates (n,), and the expected ones (n, 3) with their errors (n,), rad/s.

    Blocks slide at 0.5 to 2 m/s. Of the turn a metre `own_rad_m` is each stretch's own, and `of_slides` each slide's.
    """
    rng = np.random.default_rng(20261150)
    run, speed = np.repeat(np.arange(STRETCHES // OF_A_RUN), OF_A_RUN), rng.uniform(0.5, 2.0, STRETCHES)
    true = speed * (rng.normal(0.0, own_rad_m, STRETCHES) + rng.normal(0.0, of_slides, STRETCHES // OF_A_RUN)[run])
    measured = true + rng.normal(0.0, SIGMA, STRETCHES)
    across = np.repeat(np.column_stack([measured, speed]), 3, axis=0).reshape(STRETCHES, 3, 2)
    expected, error = expected_rates(across[..., 0], np.full(STRETCHES, SIGMA), across[..., 1], run)
    return true, expected, error


@pytest.mark.parametrize(("own_rad_m", "of_slides"), [(0.2, 0.0), (1.0, 0.0), (0.2, 0.3), (0.5, 0.5)])
def test_true_rates_are_as_large_as_expected(own_rad_m: float, of_slides: float) -> None:
    """A regression of the true rates on the expected ones has slope 1; on the measured ones it is smaller."""
    true, expected, error = seen(own_rad_m, of_slides=of_slides)
    middle = expected[:, 1]
    assert float(true @ middle / (middle @ middle)) == pytest.approx(1.0, abs=0.05)
    assert float(np.std((true - middle) / error)) == pytest.approx(1.0, rel=0.05)


def test_slides_have_a_turn_of_their_own_a_metre() -> None:
    """Five stretches tell it to a tenth of what one tells, also for those that are too slow to show it."""
    true, expected, error = seen(0.0, of_slides=1.0)
    slope = float(true @ expected[:, 1] / np.square(expected[:, 1]).sum())
    assert slope == pytest.approx(1.0, abs=0.02)
    assert np.std((true - expected[:, 1]) / error) == pytest.approx(1.0, rel=0.1)
    assert np.median(error) < 0.5 * SIGMA


def test_blocks_that_do_not_turn_are_not_expected_to() -> None:
    _, expected, error = seen(0.0)
    assert np.sqrt(np.mean(np.square(expected))) < 0.05 * SIGMA
    assert error.max() < 0.3 * SIGMA


def test_without_stretches_nothing_is_expected() -> None:
    nothing = np.zeros((0, 3))
    expected, error = expected_rates(nothing, np.zeros(0), nothing, np.zeros(0, dtype=np.int64))
    assert expected.shape == (0, 3)
    assert error.shape == (0,)

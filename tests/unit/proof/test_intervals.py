import math

import numpy as np
import pytest

from tests.proof.intervals import bootstrap, wilson


def test_wilson_is_the_published_interval():
    # Newcombe 1998, Stat. Med. 17, 857, table I: 81 of 263, 15 of 148, 0 of 20, 1 of 29 by the score method.
    assert wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=1e-4)
    assert wilson(15, 148) == pytest.approx((0.0624, 0.1605), abs=1e-4)
    assert wilson(0, 20) == pytest.approx((0.0, 0.1611), abs=1e-4)
    assert wilson(1, 29) == pytest.approx((0.0061, 0.1718), abs=1e-4)


def test_no_cases_have_no_interval():
    assert all(math.isnan(end) for end in wilson(0, 0))
    assert all(math.isnan(end) for end in bootstrap([1.0], lambda x: float(x.mean()), rng=np.random.default_rng(1)))


def test_the_bootstrap_of_a_mean_is_that_of_its_standard_error():
    values = np.random.default_rng(3).normal(5.0, 2.0, 400)
    low, high = bootstrap(values, lambda x: float(x.mean()), rng=np.random.default_rng(1))
    assert (high - low) / 2 == pytest.approx(1.96 * 2.0 / 20, rel=0.1)
    assert low < values.mean() < high

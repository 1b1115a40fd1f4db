"""A tilt turns round: noise, a rounded report and an overshoot are no turn, and each turn has its tilt."""

import numpy as np
import pytest

from station.physics.reversals import rising, turned_at

TIME_S = np.arange(0.0, 4.0, 0.01)
TILT_RAD = np.interp(TIME_S, [0.0, 1.0, 2.0, 2.5, 4.0], [0.0, 0.3, 0.3, 0.1, 0.2])


@pytest.mark.parametrize("noise_rad", [0.0, 5e-5])
def test_a_plate_at_rest_keeps_its_last_direction_whatever_its_readings_noise(noise_rad: float) -> None:
    tilt = TILT_RAD + np.random.default_rng(1).normal(0.0, noise_rad, len(TIME_S))
    found = rising(TIME_S, tilt, TIME_S)
    apart = np.min(np.abs(TIME_S[:, None] - [2.0, 2.5]), axis=1) > 0.06
    wanted = np.where((TIME_S > 2.0) & (TIME_S < 2.5), -1.0, 1.0)
    assert (found == wanted)[apart].all()


def test_the_tilt_of_a_turn_is_the_farthest_that_it_had_come() -> None:
    sign = rising(TIME_S, TILT_RAD, TIME_S)
    turned, swing = turned_at(TILT_RAD, sign, before_rad=-np.inf)
    assert (turned[TIME_S < 1.9] == -np.inf).all()
    assert turned[TIME_S == 2.3] == pytest.approx(0.3)
    assert turned[-1] == pytest.approx(0.1, abs=2e-3)
    assert swing[-1, 0] == pytest.approx(0.2, abs=2e-3)


def test_a_turn_between_two_knots_has_the_tilt_of_the_knot() -> None:
    """The directions are those of the stretches after each knot."""
    turned, _ = turned_at(np.array([0.0, 0.3]), np.array([1.0, -1.0]), before_rad=0.0)
    assert turned.tolist() == [0.0, 0.3]


def test_a_swing_back_that_is_gone_through_again_leaves_no_trace() -> None:
    """Up to 0.3, back to 0.25, and within that up to 0.28 and back to 0.26: beyond 0.28 and 0.3 they are forgotten."""
    tilt = np.array([0.0, 0.3, 0.25, 0.28, 0.26, 0.27, 0.29, 0.31])
    sign = np.array([1.0, -1.0, 1.0, -1.0, 1.0, 1.0, 1.0, 1.0])
    turned, swing = turned_at(tilt, sign, before_rad=0.0)
    assert turned.tolist() == [0.0, 0.3, 0.25, 0.28, 0.26, 0.26, 0.25, 0.0]
    assert swing[:, 0] == pytest.approx([np.inf, 0.3, 0.05, 0.03, 0.02, 0.02, 0.05, np.inf])
    assert swing[4] == pytest.approx([0.02, 0.03, 0.05])

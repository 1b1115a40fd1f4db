"""The search for a session's law reaches the likeliest numbers: along ridges, from convex places, and at bounds."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from station.diagnosis.observations.breakaway_search import Effort, Sloped, climbed
from station.physics.contact import Array

WIDE = np.array([(-9.0, 9.0), (-9.0, 9.0)])
THOROUGH = Effort(200, 1e-9)


def _ridge(at: Array) -> Sloped:
    """Rosenbrock's function upside down, whose ridge is narrow and bent; its maximum is 0 at (1, 1)."""
    x, y = at
    off = y - x * x
    slope = np.array([400.0 * x * off - 2.0 * (x - 1.0), -200.0 * off])
    observed = np.array([[2.0 - 400.0 * (y - 3.0 * x * x), -400.0 * x], [-400.0 * x, 200.0]])
    complete = np.array([[2.0 + 800.0 * x * x, -400.0 * x], [-400.0 * x, 200.0]])
    return Sloped(-((1.0 - x) ** 2) - 100.0 * off * off, slope, complete, observed)


def _hat(at: Array) -> Sloped:
    """A function that is convex in x between its two maxima of 0, at x = ±1, and concave in y."""
    x, y = at
    value = -((x * x - 1.0) ** 2) - y * y
    slope = np.array([-4.0 * x * (x * x - 1.0), -2.0 * y])
    return Sloped(value, slope, np.diag([12.0 * x * x + 4.0, 2.0]), np.diag([12.0 * x * x - 4.0, 2.0]))


@pytest.mark.parametrize(
    ("function", "begin", "reached"),
    [(_ridge, (-1.2, 1.0), (1.0, 1.0)), (_hat, (0.05, 2.0), (1.0, 0.0)), (_hat, (-0.05, 2.0), (-1.0, 0.0))],
)
def test_the_search_reaches_the_maximum(
    function: Callable[[Array], Sloped], begin: tuple[float, float], reached: tuple[float, float]
) -> None:
    """It follows a bent ridge, and leaves a convex place upwards."""
    numbers, value = climbed(function, np.array(begin), WIDE, THOROUGH)
    assert numbers == pytest.approx(np.array(reached), abs=1e-3)
    assert value == pytest.approx(0.0, abs=1e-6)


def test_the_search_ends_at_a_bound_that_hides_the_maximum() -> None:
    """The other number still reaches its best value there."""
    numbers, _ = climbed(_ridge, np.array([-1.2, 1.0]), np.array([(-9.0, 0.5), (-9.0, 9.0)]), THOROUGH)
    assert numbers == pytest.approx(np.array([0.5, 0.25]), abs=1e-3)


def _slanted(at: Array) -> Sloped:
    """A hill whose maximum at (10, -8) lies behind a bound, across a ridge to which both numbers belong."""
    curvature, off = np.array([[1.0, 0.99], [0.99, 1.0]]), at - np.array([10.0, -8.0])
    return Sloped(-0.5 * float(off @ curvature @ off), -curvature @ off, curvature, curvature)


def test_a_step_that_is_cut_off_at_a_bound_does_not_end_the_search() -> None:
    """Newton's step is (10, -8): cut off at 0.5 it leads down, and the search took that for its end."""
    numbers, _ = climbed(_slanted, np.zeros(2), np.array([(-9.0, 0.5), (-9.0, 9.0)]), THOROUGH)
    assert numbers == pytest.approx(np.array([0.5, -8.0 + 0.99 * 9.5]), abs=1e-3)


def test_a_search_of_no_steps_stays() -> None:
    """The value is that of its beginning, moved into the bounds."""
    numbers, value = climbed(_ridge, np.array([12.0, 3.0]), np.array([(-9.0, 2.0), (-9.0, 9.0)]), Effort(0, 0.0))
    assert numbers.tolist() == [2.0, 3.0]
    assert value == _ridge(numbers).value

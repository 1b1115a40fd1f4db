"""The moment at which a block begins to slide is the zero of what it lacks, whatever the curve between two moments."""

from __future__ import annotations

import numpy as np
import pytest

from station.physics.contact import Array
from station.simulators.planar.root import root

ZERO_S = np.array([0.2, 0.5, 0.9])


@pytest.mark.parametrize("power", [1.0, 1.5, 0.4])
def test_the_zero_of_each_curve_is_closed_in_on_from_above(power: float) -> None:
    def at(time_s: Array, way: Array | None) -> tuple[Array, Array]:
        past = time_s - ZERO_S
        return np.sign(past) * np.abs(past) ** power, 2.0 * time_s

    found, way = root(at, np.zeros(3), np.ones(3))
    assert found == pytest.approx(ZERO_S, abs=1e-6)
    assert (at(found, None)[0] >= 0).all(), "a block that has been let go slides"
    assert way == pytest.approx(2.0 * found)


def test_what_slides_from_the_first_moment_slides_then() -> None:
    found, way = root(lambda time_s, _: (1.0 + time_s, 3.0 - time_s), np.array([0.3]), np.array([1.0]))
    assert (found, way) == (pytest.approx([0.3]), pytest.approx([2.7]))


def test_the_direction_of_one_look_is_the_guess_for_the_next() -> None:
    guesses: list[float | None] = []

    def at(time_s: Array, way: Array | None) -> tuple[Array, Array]:
        guesses.append(None if way is None else float(way[0]))
        return time_s**2 - 0.5, time_s.copy()

    root(at, np.zeros(1), np.ones(1))
    assert guesses[:2] == [None, None]
    assert guesses[2:4] == [1.0, 1.0], "the upper end stays while the lower one moves"

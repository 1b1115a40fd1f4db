"""Laws whose friction falls steeply at next to no speed: slopes overflow there, and nothing else may."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from shared.geometry import Array
from station.diagnosis.observations.breakaway_marginal import UNLIKELY, marginal
from station.diagnosis.observations.breakaway_tables import COUNT, Along, Laws, cubics
from tests.unit.diagnosis.test_swing import paths, session


@dataclass(frozen=True)
class Table:
    """A law of sliding by its table (COUNT,), the ratio of sliding to static friction."""

    held: Array

    def of_runs(self, runs: int) -> Laws:
        alike = np.zeros(runs, dtype=np.int64)
        none = cubics(np.zeros(COUNT))[None]
        return Laws(held=cubics(self.held)[None], slowing_m_s2=none, of_run=alike, spread=0.1, creep_m=1e-4)


def jagged(seed: int) -> Table:
    """Friction that jumps up and down from speed to speed, about that at rest."""
    return Table(1.0 + 0.3 * np.random.default_rng(seed).standard_normal(COUNT))


@pytest.mark.parametrize("size", [1e100, 1e160, 1e200])
def test_columns_that_are_too_large_make_a_moment_unlikely(size: float) -> None:
    """It was no number, which became a moment of slip, and the program read beyond its tables and ended."""
    value, one = np.linspace(-1.0, 1.0, 9), np.linspace(0.0, 1.0, 9)
    two = np.linspace(0.0, 1.0, 9) ** 2 * size
    found = marginal(value, one, two, 9)
    assert np.isfinite(found)
    assert found == UNLIKELY or size < 1e150


@pytest.mark.parametrize("size", [1e20, 1e70])
def test_a_path_that_runs_away_is_unlikely(size: float) -> None:
    """It runs away as its slope by D does, and what that explains of it was more than all of it by rounding."""
    two = np.linspace(0.0, 1.0, 9) ** 2 * size
    assert all(marginal(two * share, np.linspace(0.0, 1.0, 9), two.copy(), 9) == UNLIKELY for share in (0.3, 1.0, 1.7))


@pytest.mark.parametrize("seed", range(12))
def test_moments_stay_numbers_whatever_the_law(seed: int) -> None:
    known = paths(session((0.0, 0.0, 0.0)))
    chance = known.chances(jagged(seed))
    assert np.isfinite(chance).all()
    assert chance.sum(axis=1) == pytest.approx(1.0)
    assert np.isfinite(known.around(jagged(seed), 9).tried_s).all()


@pytest.mark.parametrize("seed", range(4))
def test_slopes_stay_numbers_whatever_the_law(seed: int) -> None:
    tables = np.stack([np.ones(COUNT), np.linspace(0.0, 1.0, COUNT)])
    along = Along(cubics(tables[:1])[:, None], cubics(tables[1:])[:, None])
    found = paths(session((0.0, 0.0, 0.0))).sloped(jagged(seed), along)
    assert np.isfinite(found.value)
    assert np.isfinite(found.slope).all()
    assert np.isfinite(found.observed).all()

"""The normal distribution for whole arrays, against Python's own for one number at a time."""

from math import erf, sqrt

import numpy as np
import pytest

from pi_agent.tracking import normal, steps


def test_the_distribution_is_exact_everywhere() -> None:
    u = np.concatenate([np.random.default_rng(20261190).uniform(-10.0, 10.0, 5000), [-40.0, -9.0, 0.0, 9.0, 40.0]])
    one_by_one = [0.5 * (1.0 + erf(x / sqrt(2.0))) for x in u.tolist()]
    np.testing.assert_allclose(normal.cumulative(u), one_by_one, rtol=0.0, atol=1e-15)


def test_its_integral_has_it_as_its_slope() -> None:
    u = np.linspace(-6.0, 6.0, 241)
    slope = (normal.area(u + 1e-4) - normal.area(u - 1e-4)) / 2e-4
    np.testing.assert_allclose(slope, normal.cumulative(u), rtol=0.0, atol=1e-8)


def test_the_estimators_are_made_without_a_call_for_each_of_their_places(monkeypatch: pytest.MonkeyPatch) -> None:
    """Counted, not timed: with a call of `erf` for each place of each estimator a Pi took ten seconds."""
    calls: list[float] = []

    def counted(x: float) -> float:
        calls.append(x)
        return erf(x)

    monkeypatch.setattr(normal, "erf", counted)
    steps.MovingModels(textured=True)
    steps.MovingModels(textured=False)
    assert len(calls) <= 2 * normal.FARTHEST * normal.NODES + 1

"""Scores in other numbers of runs, and gains as a search has them that estimates its noise anew."""

from __future__ import annotations

import numpy as np
import pytest

from station.diagnosis.inference.columns import Absorbed, Scores
from station.diagnosis.next_experiment.own_noise import shares_of_priors, with_own_noise
from station.physics.contact import Array

PRECISION = np.array([0.0, 4.0, 900.0])


def scored(own: Array, columns: Array, *, runs: int) -> Scores:
    """The scores of columns (n, K) of unit noise beside a model's own (n, 3), by their definition."""
    within = own.T @ own
    projection = np.linalg.pinv(within + np.diag(PRECISION), hermitian=True) @ own.T @ columns
    left, absorbed = columns - own @ projection, Absorbed(within, PRECISION, projection)
    none, bound = np.zeros(columns.shape[1]), np.full(columns.shape[1], np.inf)
    return Scores(
        variants=(), information=left.T @ left + absorbed.resisted, score=none, of_runs=none[None], low=-bound,
        high=bound, runs=runs, rows=np.square((left**2).sum(axis=0)) / (left**4).sum(axis=0), absorbed=absorbed,
    )  # fmt: skip


@pytest.mark.parametrize("times", [2, 5])
def test_more_of_the_same_runs_are_as_if_they_had_been_done(times: int) -> None:
    rng = np.random.default_rng(7)
    own = rng.standard_normal((60, 3))
    columns = np.column_stack([own[:, 2] + 0.1 * rng.standard_normal(60), own[:, 1], rng.standard_normal(60)])
    some, done = scored(own, columns, runs=20), scored(np.tile(own, (times, 1)), np.tile(columns, (times, 1)), runs=20)
    foretold = some.in_runs(20.0 * times)
    assert foretold.information == pytest.approx(done.information, rel=1e-9)
    assert foretold.absorbed.projection == pytest.approx(done.absorbed.projection, rel=1e-9)
    assert foretold.in_runs(20.0).information == pytest.approx(some.information, rel=1e-9)
    # A number that only a prior keeps from being absorbed is hardly known better by more runs.
    assert done.information[1, 1] < 1.2 * some.information[1, 1] < times * some.information[1, 1]


def test_a_gain_is_what_a_fit_with_its_own_noise_has() -> None:
    """A truth, a rival that is much like it, and one that has nothing of it, against fits to drawn residuals."""
    rng, runs, size = np.random.default_rng(8), 400, 3.0
    signs, apart = np.sign(rng.standard_normal((2, runs)))
    columns = size * np.column_stack([signs, 0.8 * signs + 0.6 * apart, apart])
    found = scored(np.zeros((runs, 3)), columns, runs=runs)
    expected = [np.array([found.information[one, 0] ** 2 / found.information[one, one]]) for one in range(3)]
    twice = with_own_noise(found, 0, [(0,), (1,), (2,)], expected)[:, 0]
    drawn = columns[:, 0] + rng.standard_normal((200, runs))

    def fitted(column: Array) -> float:
        left = drawn - np.outer(drawn @ column / (column @ column), column)
        return float(np.mean(runs * np.log((drawn**2).sum(axis=1) / (left**2).sum(axis=1))))

    assert found.rows[0] == pytest.approx(runs)
    assert twice[:2] == pytest.approx([fitted(column) for column in columns.T[:2]], rel=0.02)
    assert twice[2] == pytest.approx(fitted(columns[:, 2]), abs=2.0)


def test_what_a_prior_loses_is_not_taken_for_noise() -> None:
    rng = np.random.default_rng(9)
    own = np.column_stack([np.zeros(200), np.zeros(200), np.full(200, 10.0)])
    shift = np.ones((200, 1)) + 1e-3 * rng.standard_normal((200, 1))
    found = scored(own, 0.5 * shift, runs=200)
    assert shares_of_priors(found, 0, [(0,)])[0] > 0.8
    gain = float(found.information[0, 0])
    assert 0.8 * gain < float(with_own_noise(found, 0, [(0,)], [np.array([gain])])[0, 0]) <= gain

"""The expected directions of slides: right on average, whatever turns the slides, and however they are measured."""

from __future__ import annotations

import math

import numpy as np
import pytest

from station.diagnosis.observations.directions import ExpectedDirections, expected_directions
from station.physics.contact import Array

RUNS, WINDOWS = 96, 6
RUN = np.repeat(np.arange(RUNS), WINDOWS)
SIGMA = 0.01


def seen(rng: np.random.Generator, *, wave_rad: float, own_rad: float) -> tuple[Array, ExpectedDirections]:
    """The true deviations (rows, 3), rad, of slides in four directions, of blocks that turn slowly, and the expected.

    The rows of a run share the error of its direction, which is that of its whole path.
    """
    down = np.repeat(rng.integers(0, 4, RUNS) * 0.5 * math.pi, WINDOWS)
    yaw = np.repeat(np.linspace(0.0, -0.7, RUNS), WINDOWS)
    true = wave_rad * np.sin(down - 0.4) + rng.normal(0.0, own_rad, RUNS)[RUN]
    measured = true + rng.normal(0.0, SIGMA, RUNS)[RUN]
    at_nodes: list[Array] = [
        np.asarray(np.repeat(values[:, None], 3, axis=1), dtype=np.float64) for values in (measured, down, down - yaw)
    ]
    found = expected_directions(at_nodes[0], np.full(len(RUN), SIGMA), (at_nodes[1], at_nodes[1], at_nodes[2]), RUN)
    return np.repeat(true[:, None], 3, axis=1), found


def test_slides_that_nothing_turns_go_down() -> None:
    """The waves that least squares would find in the noise are off by a third of a direction's error."""
    rng = np.random.default_rng(20261130)
    wrong = [seen(rng, wave_rad=0.0, own_rad=0.0)[1].off_rad for _ in range(20)]
    assert np.sqrt(np.mean(np.square(wrong))) < 0.2 * SIGMA


@pytest.mark.parametrize(("wave_rad", "own_rad"), [(0.03, 0.0), (0.0, 0.02), (0.03, 0.02)])
def test_deviations_are_as_large_as_expected(wave_rad: float, own_rad: float) -> None:
    """A regression of the true deviations on the expected ones has a slope of 1."""
    rng = np.random.default_rng(20261131)
    drawn = [seen(rng, wave_rad=wave_rad, own_rad=own_rad) for _ in range(20)]
    true, expected = np.array([one for one, _ in drawn]), np.array([found.off_rad for _, found in drawn])
    assert (true * expected).sum() / (expected**2).sum() == pytest.approx(1.0, abs=0.06)


def test_what_similar_slides_share_is_none_of_their_own() -> None:
    """Thirty waves of ninety-six runs take some of their own deviations; by far the most of these stay."""
    rng = np.random.default_rng(20261132)
    _, found = seen(rng, wave_rad=0.03, own_rad=0.02)
    assert np.std(found.common_rad) == pytest.approx(0.03 / math.sqrt(2.0), rel=0.2)
    own = 0.02**2 / math.hypot(0.02, SIGMA)  # the spread that can be expected of it, given so noisy a measurement
    assert 0.6 * own < np.std(found.off_rad - found.common_rad) < 1.1 * own


def test_a_direction_that_is_known_well_is_taken_as_it_is() -> None:
    """Slides turn by a milliradian from beginning to end, which their paths tell to a third of that."""
    rng = np.random.default_rng(20261133)
    down = np.repeat(rng.uniform(0.0, 2.0 * math.pi, RUNS), WINDOWS)
    turns = np.outer(rng.normal(0.0, 1e-3, RUNS), np.linspace(-1.0, 1.0, WINDOWS)).ravel()
    true = np.repeat(turns[:, None], 3, axis=1)
    measured = true + np.repeat(rng.normal(0.0, 3e-4, RUNS)[RUN][:, None], 3, axis=1)
    angles = np.repeat(down[:, None], 3, axis=1)
    found = expected_directions(measured, np.full(len(RUN), 3e-4), (angles, angles, angles), RUN)
    assert (true * found.off_rad).sum() / (true**2).sum() > 0.75  # a floor of a milliradian left nothing

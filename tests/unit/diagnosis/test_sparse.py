"""Columns of which only what is not zero is kept, and whitened some runs at a time, are what they are in full."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from station.diagnosis import thresholds
from station.diagnosis.inference.columns import looked, pushed_out, scores, scores_of
from station.diagnosis.inference.fit import Fit, fit
from station.diagnosis.inference.noise_of import shaking_of
from station.diagnosis.inference.sparse import Index, Table, by_channel
from station.diagnosis.likelihood.feedback import owed_slope
from station.diagnosis.likelihood.slopes import decay_differences, decays, residuals, slopes
from station.diagnosis.likelihood.student import pulls
from station.diagnosis.likelihood.whitening import Whitening, stack
from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.cubics import Cubics
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.setting import Setting
from station.physics.catalogue import catalogue
from station.physics.contact import Array
from station.physics.model import Model, Term
from tests.unit.diagnosis import recorded


@pytest.fixture(scope="module")
def fitted() -> tuple[Evidence, Fit]:
    """A session of several channels, a fifth of whose runs are held out."""
    setting = Setting(opening_radius_m=recorded.OPENING_RADIUS_M)
    evidence = evidence_of(recorded.joined([recorded.session()]), setting)
    evidence = evidence.without(np.arange(evidence.runs) % 5 == 0)
    return evidence, fit(evidence, Model(mu_s=0.4), ())


def of_channels(evidence: Evidence, rng: np.random.Generator) -> dict[str, Array]:
    """Two columns of the first channel and one of the second, of four; the others are zero."""
    parts = {channel.name: np.zeros((len(channel), 4)) for channel in evidence.channels}
    one, other = (channel.name for channel in evidence.channels[:2])
    parts[one][:, [0, 2]] = rng.normal(size=(len(parts[one]), 2))
    parts[other][:, 2] = rng.normal(size=len(parts[other]))
    return parts


def test_a_table_is_what_it_is_in_full(fitted: tuple[Evidence, Fit]) -> None:
    evidence, rng = fitted[0], np.random.default_rng(1)
    first, second = of_channels(evidence, rng), of_channels(evidence, rng)
    one, other = by_channel(evidence, first, 4), by_channel(evidence, second, 4)
    full = np.column_stack([stack(evidence, first), stack(evidence, second)])
    table, rows = one.beside(other), rng.permutation(len(full))[:20]
    np.testing.assert_array_equal(table.whole(), full)
    np.testing.assert_array_equal(table.of(rows), full[rows])
    np.testing.assert_array_equal(table.chosen([6, 1, 0]).whole(), full[:, [6, 1, 0]])
    assert sum(piece.values.size for piece in table.pieces) < full.size / 2


@pytest.mark.parametrize("most", [1, 50, 10**6])
def test_runs_that_are_whitened_apart_are_whitened_alike(fitted: tuple[Evidence, Fit], most: int) -> None:
    evidence, found = fitted
    whitening = Whitening(evidence, found.noise)
    values = np.random.default_rng(2).normal(size=(len(whitening.run), 3))
    white = np.full_like(values, np.nan)
    for rows, whiten in whitening.parts(most):
        white[rows] = whiten(values[rows])
    np.testing.assert_array_equal(white, whitening(values))


def test_scores_are_those_of_the_whole_table(fitted: tuple[Evidence, Fit], monkeypatch: pytest.MonkeyPatch) -> None:
    """The formula with all rows at once gives the same, in a few lines."""
    evidence, found = fitted
    monkeypatch.setattr(Whitening, "parts", in_small_parts)
    effects = [catalogue()[name] for name in ("contact_aging", "viscous", "camera_sag", "plate_anisotropy")]
    seen = looked(evidence, found.model, effects)
    scored = scores_of(evidence, found, seen)
    information, score = at_once(evidence, found, seen.table.rows, seen.table.decay)
    known = np.diag(scored.information) > 0.0
    assert known.sum() > 4
    np.testing.assert_allclose(scored.information[known][:, known], information[known][:, known], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(scored.score[known], score[known], rtol=1e-9, atol=1e-9)


PARTS = Whitening.parts


def in_small_parts(whitening: Whitening) -> Iterator[tuple[Index, Callable[[Array], Array]]]:
    return PARTS(whitening, 50)


def at_once(evidence: Evidence, found: Fit, table: Table, decay: Table) -> tuple[Array, Array]:
    """Information (K, K) and score (K,) of the columns beside the fit's own numbers that are not held at a bound."""
    at = residuals(evidence, found.model)
    whitening = Whitening(evidence, found.noise, shaking=shaking_of(evidence, found.model))
    counted = evidence.counted[whitening.run]
    tail = whitening.tail[counted]
    pull, curvature = pulls(whitening(stack(evidence, at))[counted], tail, whitening.limit[counted])
    of_row = np.where(tail >= thresholds.GAUSSIAN, 1.0, (tail + 1) / (tail + 3))
    root = np.sqrt(np.where(whitening.limit[counted], curvature, of_row))[:, None]
    own = whitening(stack(evidence, slopes(evidence, found.model, found.free, at)))[counted]
    columns = whitening(table.whole())[counted]
    of_decay = owed_slope(whitening, decays(evidence, found.model))[counted]
    own_owed = of_decay @ stack(evidence, decay_differences(evidence, found.model, found.free))[counted]
    precision = np.array([number.precision for number in found.free])
    free_to_move = ~pushed_out(found, own_owed - pull @ own - precision * found.vector)
    owed = of_decay @ decay.whole()[counted]
    own, precision, vector = own[:, free_to_move], precision[free_to_move], found.vector[free_to_move]
    among = (root * own).T @ (root * own) + np.diag(precision)
    taken = np.linalg.solve(among, (root * own).T @ (root * columns))
    free = columns - own @ taken
    score = owed - pull @ free + taken.T @ (precision * vector - own_owed[free_to_move])
    return (root * free).T @ (root * free) + taken.T @ np.diag(precision) @ taken, score


def test_cubics_are_scipy_s() -> None:
    """Values, slopes, second derivatives; before, between and beyond the readings."""
    rng = np.random.default_rng(3)
    time_s = np.cumsum(rng.uniform(0.005, 0.02, 300))
    values, slope = rng.normal(size=(300, 3)), rng.normal(size=(300, 3))
    ours, theirs = Cubics(time_s, values, lambda places: slope[places]), CubicHermiteSpline(time_s, values, slope)
    seconds = np.concatenate([rng.uniform(time_s[0] - 0.01, time_s[-1] + 0.01, 1000), time_s])
    np.testing.assert_allclose(ours(seconds), theirs(seconds), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(ours.slope(seconds), theirs.derivative()(seconds), rtol=1e-11, atol=1e-9)
    np.testing.assert_allclose(ours.bends(), theirs.derivative(2)(time_s[:-1]), rtol=1e-11, atol=1e-9)


def test_a_number_that_is_pushed_against_its_bound_absorbs_nothing(fitted: tuple[Evidence, Fit]) -> None:
    """Blocks that seem to have more friction while they slide leave no drop, and a drop below zero explains nothing."""
    evidence, plain = fitted
    drop, offered = catalogue()["kinetic_drop"], [catalogue()[name] for name in ("viscous", "wear")]
    held = fit(evidence, plain.model.with_term(Term(drop, drop.neutral())), (drop,), noise=plain.noise)
    assert held.at_bound("kinetic_drop", "drop")
    without, beside = (scores(evidence, one, offered) for one in (plain, held))
    np.testing.assert_allclose(beside.information, without.information, rtol=1e-3)
    np.testing.assert_allclose(beside.score, without.score, atol=0.05 * np.sqrt(np.diag(without.information)).max())

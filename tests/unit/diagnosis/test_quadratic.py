"""The quadratic model around a point: its maximum, and how a step follows a valley that bends."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from station.diagnosis.inference.errors import Curvature
from station.diagnosis.inference.quadratic import BENT, Quadratic
from station.physics.contact import Array

NARROW = 1e-3
"""The noise of the residual that makes a narrow valley of the parabola y = x²."""


def _residuals(at: Array) -> Array:
    return np.array([(at[1] - at[0] ** 2) / NARROW, 1.0 - at[0]])


def _curvature(at: Array) -> Curvature:
    slope = np.array([[-2.0 * at[0] / NARROW, 1.0 / NARROW], [-1.0, 0.0]])
    tail, none = np.full(2, np.inf), np.zeros(2, dtype=np.bool_)
    return Curvature(
        slope=slope, pull=_residuals(at), curve=np.ones(2), tail=tail, limit=none, run=np.zeros(2, dtype=np.int64)
    )


def test_a_step_ends_at_the_maximum_between_its_bounds() -> None:
    """SciPy finds the same maximum, where clipping the free maximum would lead elsewhere."""
    rng = np.random.default_rng(3)
    root = rng.normal(size=(4, 4))
    quadratic = Quadratic(rng.normal(size=4), root @ root.T + 0.1 * np.eye(4))
    least, most = np.full(4, -0.2), np.full(4, 0.3)

    def loss(move: Array) -> float:
        return float(quadratic.gradient @ move + 0.5 * move @ quadratic.hessian @ move)

    found, promised = quadratic.step(least, most)
    known = minimize(loss, np.zeros(4), bounds=list(zip(least, most, strict=True)), tol=1e-12)
    assert found == pytest.approx(known.x, abs=1e-5)
    assert promised == pytest.approx(-known.fun, abs=1e-8)
    assert np.clip(-np.linalg.solve(quadratic.hessian, quadratic.gradient), least, most) != pytest.approx(found)


def test_a_damped_step_moves_what_is_told_well_and_hardly_what_is_not() -> None:
    """Data tell the sum of two numbers, and their difference badly: the sum goes its way, the difference stays."""
    told = np.array([1.0, 1.0]) / np.sqrt(2.0), np.array([1.0, -1.0]) / np.sqrt(2.0)
    hessian = 1e4 * np.outer(told[0], told[0]) + np.outer(told[1], told[1])
    quadratic = Quadratic(-hessian @ (told[0] + 5.0 * told[1]), hessian)
    free, _ = quadratic.step(np.full(2, -30.0), np.full(2, 30.0))
    damped, promised = quadratic.step(np.full(2, -30.0), np.full(2, 30.0), damping=1e-2)
    assert [free @ one for one in told] == pytest.approx([1.0, 5.0], rel=1e-3)
    assert [damped @ one for one in told] == pytest.approx([1.0, 0.1], abs=0.02)
    assert 0.99 * 0.5e4 < promised < 0.5e4 + 12.5


def test_a_bent_step_stays_in_a_curved_valley() -> None:
    """Half a Newton step leaves the narrow valley y = x² by 250 of its widths, its bend returns to it."""
    start, none = np.zeros(2), np.zeros(2)
    here, shrink = _curvature(start), 0.5
    quadratic = Quadratic.of(here, start, none)
    move, _ = quadratic.step(np.full(2, -9.0), np.full(2, 9.0))
    straight = start + shrink * move
    bent = 2.0 / shrink**2 * (_residuals(straight) - _residuals(start) - here.slope @ (straight - start))
    bend = quadratic.bend(here, bent, move, shrink)
    assert abs(_residuals(straight)[0]) == pytest.approx(250.0, rel=0.01)
    assert abs(_residuals(straight + 0.5 * shrink**2 * bend)[0]) < 1.0


def test_a_bend_is_no_longer_than_trusted() -> None:
    """The bent way is longer than the straight one by BENT of it at most, where the residuals turn sharply."""
    here = _curvature(np.zeros(2))
    quadratic = Quadratic.of(here, np.zeros(2), np.zeros(2))
    move = np.array([1.0, 0.0])
    bend = quadratic.bend(here, np.array([1e9, 0.0]), move, 0.5)
    assert 0.5 * 0.5**2 * np.linalg.norm(bend) == pytest.approx(BENT * 0.5 * np.linalg.norm(move))

"""Rows that a model predicts from their own motion owe something to that; a law is told right with it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.integrate import quad

from station.diagnosis.likelihood.feedback import owed, owed_slope
from station.diagnosis.likelihood.whitening import Whitening
from station.physics.contact import Array

WINDOW_S, STEPS, WINDOWS, SLIDES = 0.1, 50, 8, 2000
DRAG_PER_S = 6.0


def unread(share: Array | float, count: int) -> Whitening:
    """Stands for a whitening, with the share of each row's variance that is not its reading's."""
    return cast(Whitening, SimpleNamespace(unread=np.broadcast_to(share, count)))


@pytest.mark.parametrize("decay", [-6.0, -1.0, -2e-3, -5e-4, 0.0, 5e-4, 2e-3, 0.5, 3.0, 30.0])
def test_what_is_owed_is_the_integral_of_its_slope(decay: float) -> None:
    """Its slope is that of an exponential decay within the window: (x − 1 + exp(−x)) / x²."""

    def slope(x: float) -> float:
        return (x + np.expm1(-x)) / x**2 if abs(x) > 1e-2 else 0.5 - x / 6.0 + x**2 / 24.0 - x**3 / 120.0

    at = np.array([decay])
    assert owed(unread(1.0, 1), at)[0] == pytest.approx(quad(slope, 0.0, decay)[0], abs=1e-8)
    assert owed_slope(unread(1.0, 1), at)[0] == pytest.approx(slope(decay), abs=1e-8)


def test_a_law_that_falls_without_bound_owes_a_number() -> None:
    assert np.isfinite(owed(unread(1.0, 2), np.array([-1e6, 1e6]))).all()
    assert np.isfinite(owed_slope(unread(1.0, 2), np.array([-1e6, 1e6]))).all()


def test_an_error_of_reading_owes_nothing() -> None:
    decay, share = np.array([1.0, 1.0, 0.0]), np.array([0.0, 0.25, 1.0])
    assert owed(unread(share, 3), decay) == pytest.approx(share * owed(unread(1.0, 3), decay))
    slope = share * owed_slope(unread(1.0, 3), decay)
    assert owed_slope(unread(share, 3), decay) == pytest.approx(slope)


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_what_has_no_effect_owes_nothing_however_the_variance_is_shared(share: float) -> None:
    """Friction undoes a block's turning under any law: it says nothing of which law holds, nor of the noise."""
    decay = np.array([-0.5, 0.0, 4.0])
    assert owed(unread(share, 3), decay, decay) == pytest.approx(np.zeros(3), abs=1e-15)
    more = np.array([0.1, 0.1, 6.0])
    beyond = owed(unread(share, 3), more) - owed(unread(share, 3), decay)
    assert owed(unread(share, 3), more, decay) == pytest.approx(beyond)


def slides(rng: np.random.Generator, *, lasting: int) -> tuple[Array, Array]:
    """Mean accelerations and speeds (slides, windows) under drag and pushes that last so many steps each."""
    step_s = WINDOW_S / STEPS
    pushes = rng.standard_normal((SLIDES, WINDOWS * STEPS // lasting)).repeat(lasting, axis=1)
    kept, speed = np.exp(-DRAG_PER_S * step_s), np.zeros((SLIDES, WINDOWS * STEPS + 1))
    for k in range(WINDOWS * STEPS):
        speed[:, k + 1] = speed[:, k] * kept + pushes[:, k] * (1.0 - kept) / DRAG_PER_S
    gained = np.diff(speed[:, ::STEPS], axis=1) / WINDOW_S
    middle = 0.5 * (speed[:, 1:] + speed[:, :-1])
    return gained, middle.reshape(SLIDES, WINDOWS, STEPS).mean(axis=2)


@pytest.mark.parametrize("lasting", [1, STEPS], ids=["white", "the same over a window"])
def test_a_drag_is_told_by_the_motion_that_it_slows(lasting: int) -> None:
    """Least squares say that there is hardly any: its residuals are smaller by what unknown pushes did to the speed."""
    gained, speed = slides(np.random.default_rng(20261159), lasting=lasting)
    drags = np.linspace(-4.0, 16.0, 401)
    likelihood, square = np.zeros(len(drags)), np.zeros(len(drags))
    for k, drag in enumerate(drags):
        left = gained + drag * speed
        square[k] = np.mean(left**2)
        more = owed(unread(1.0, 1), np.array([drag * WINDOW_S]))[0]
        likelihood[k] = -0.5 * np.log(square[k]) + more
    assert abs(drags[np.argmin(square)] - DRAG_PER_S) > 2.0
    assert drags[np.argmax(likelihood)] == pytest.approx(DRAG_PER_S, abs=0.4)

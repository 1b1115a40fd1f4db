"""Friction undoes, within a window of a slide, what changes its own motion: how often, by law and window."""

from __future__ import annotations

import math

import numpy as np
import pytest

from station.diagnosis.likelihood.leading import PRESSURE_LEAD
from station.diagnosis.observations.channel import rows_of
from station.diagnosis.observations.slides import Along, Motion, Turn
from station.physics.catalogue import catalogue
from station.physics.contact import GRAVITY_M_S2, Array
from station.physics.model import Model, Term
from tests.unit.diagnosis.test_across import DOWN_RAD, MU, RUN, TILT_RAD, moments_of

WINDOW_NS, APART_NS = 60_000_000, 70_000_000
PLAIN = Model(mu_s=MU)
DRAG_PER_S = 0.4
"""A drag by the load: friction is larger by it times the speed, per mass."""


def channels() -> tuple[Along, Turn]:
    """Five windows of 60 ms a run, 10 ms apart, at .1 m/s on a sole of 1 cm."""
    moments = moments_of(DOWN_RAD)
    way = np.column_stack([np.cos(DOWN_RAD), np.sin(DOWN_RAD)])[1::3]
    motion = Motion(moments, 0.1 * GRAVITY_M_S2 * way, np.zeros(len(RUN)))
    begin = np.tile(np.arange(5) * APART_NS, len(RUN) // 5)
    rows = rows_of({"run": RUN, "from_ns": begin, "to_ns": begin + WINDOW_NS, "sigma": np.ones(len(RUN))}, {})
    return Along(rows, motion), Turn(rows, motion)


def lasting_s() -> Array:
    """The times since the end of the run's window before, or since the window's own begin, s."""
    return np.where(np.arange(len(RUN)) % 5 == 0, 0.06, 0.07)


def test_friction_that_does_not_know_the_speed_undoes_nothing() -> None:
    along, _ = channels()
    grain = Term(catalogue()["plate_anisotropy"], {"cos2": 0.2, "sin2": 0.0, "shape": -1.0})
    assert along.decay(PLAIN) == pytest.approx(np.zeros(len(RUN)), abs=0.0)
    assert along.decay(PLAIN.with_term(grain)) == pytest.approx(np.zeros(len(RUN)), abs=1e-9)


def test_a_drag_undoes_as_often_as_it_slows() -> None:
    along, _ = channels()
    drag = Term(catalogue()["viscous"], {"drag_n_s_m": DRAG_PER_S * 0.01, "by_load": 0.0})  # blocks of 10 g
    assert along.decay(PLAIN.with_term(drag)) == pytest.approx(DRAG_PER_S * lasting_s(), rel=1e-6)


def test_a_column_of_residuals_undoes_by_its_slope_over_the_speed() -> None:
    """A residual that grows with the speed is friction that falls with it."""
    along, _ = channels()
    found = along.undone("speed", lambda speed: np.column_stack([speed, np.ones_like(speed)]))
    held = GRAVITY_M_S2 * (math.sin(TILT_RAD) - 0.1)
    assert found == pytest.approx(np.column_stack([-held * lasting_s(), np.zeros(len(RUN))]), rel=1e-6)
    assert np.all(along.undone("slide_time", lambda since: since[:, None]) == 0.0)
    assert np.all(along.undone("previous_slide", lambda way: way[:, None]) == 0.0)


@pytest.mark.parametrize(("lead", "left"), [(0.0, 1.0), (0.1, 0.88), (0.4, 0.06)])
def test_friction_undoes_a_turning(lead: float, left: float) -> None:
    """The moment h N ω L² / 12 v on an inertia of m L² / 6, of which a leading pressure leaves a share."""
    _, turn = channels()
    held = GRAVITY_M_S2 * (math.sin(TILT_RAD) - 0.1)
    expected = left * 0.5 * held / 0.1 * lasting_s()
    model = PLAIN.with_term(Term(PRESSURE_LEAD, {"lead": lead}))
    assert turn.decay(model) == pytest.approx(expected, rel=1e-6)

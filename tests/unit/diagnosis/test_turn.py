"""The turning of slides: its rows say how far they move with the turning that was recorded."""

from __future__ import annotations

import numpy as np
import pytest

from station.diagnosis.likelihood.leading import PRESSURE_LEAD
from station.diagnosis.observations.channel import rows_of
from station.diagnosis.observations.slides import Motion, Turn
from station.diagnosis.observations.windows import NODES, WEIGHTS
from station.physics.contact import Array
from station.physics.model import Model, Term
from tests.unit.diagnosis.test_across import DOWN_RAD, MU, RUN, moments_of

LASTING_S = 0.06
PLAIN = Model(mu_s=MU)


def turn_of(yaw_rate_rad_s: Array, yaw_acceleration_rad_s2: Array, *, measured: float = 1.0) -> Turn:
    """Slides of 60 ms windows at 0.1 m/s that turn at rates (3 n,), which change by (n,)."""
    way = np.column_stack([np.cos(DOWN_RAD), np.sin(DOWN_RAD)])[len(WEIGHTS) // 2 :: len(WEIGHTS)]
    begin = np.zeros(len(RUN), dtype=np.int64)
    columns = {"run": RUN, "from_ns": begin, "to_ns": begin + round(LASTING_S * 1e9), "sigma": np.ones(len(RUN))}
    motion = Motion(
        moments_of(DOWN_RAD),
        0.5 * way,
        yaw_acceleration_rad_s2,
        yaw_rate_rad_s=yaw_rate_rad_s,
        yaw_measured=measured,
    )
    return Turn(rows_of(columns, {}), motion)


@pytest.mark.parametrize("lead", [0.0, 0.1, 0.4])
def test_the_volume_is_that_by_which_residuals_move_with_the_recorded_turning(lead: float) -> None:
    """A window that ends a little faster has turned by half of it more in between; friction acts against that."""
    model = PLAIN.with_term(Term(PRESSURE_LEAD, {"lead": lead}))
    still, faster = np.zeros(len(RUN)), 0.01
    before = turn_of(np.zeros(3 * len(RUN)), still)
    after = turn_of(np.tile(0.5 * faster * (1.0 + NODES), len(RUN)), still + faster / LASTING_S)
    moved = after.residual(model) - before.residual(model)
    assert before.log_volume(model) == pytest.approx(np.log(moved * LASTING_S / faster), abs=1e-9)


def test_a_leading_pressure_resists_less_and_moves_residuals_less() -> None:
    turn = turn_of(np.zeros(3 * len(RUN)), np.zeros(len(RUN)))
    none, some = (turn.log_volume(PLAIN.with_term(Term(PRESSURE_LEAD, {"lead": lead}))) for lead in (0.0, 0.4))
    assert (none > some + 0.1).all()


def test_a_turning_that_others_tell_moves_no_residual() -> None:
    turn = turn_of(np.zeros(3 * len(RUN)), np.zeros(len(RUN)), measured=0.0)
    assert turn.log_volume(PLAIN) == pytest.approx(np.zeros(len(RUN)), abs=0.0)

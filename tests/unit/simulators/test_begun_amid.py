"""A slide that is simulated from amid on goes on as the whole one does."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from station.physics.catalogue import catalogue
from station.physics.contact import Array
from station.physics.model import Model, Term
from station.simulators.mujoco.batch import simulate as in_mujoco
from station.simulators.planar.commands import ramps
from station.simulators.planar.simulate import simulate as in_plane

TILT_RAD, CUT_S = 0.45, 0.08
STAMPS = np.linspace(0.0, 0.2, 101)
SHAKEN = {"sd_m_s2": 0.5, "cos1": 0.0, "sin1": 0.0, "tone_hz": 5.0}
MODEL = Model(mu_s=0.3, terms=(Term(catalogue()["arm_vibration"], SHAKEN),))
"""A push that begins with the slide and fades."""


def path(simulate: Any, *, x_m: float, speed_m_s: float, slid_s: float) -> Array:
    """The way (m,) of a block that slides straight down a plate at rest and has slid for so long before."""
    start, velocity = [[x_m, 0.0, 0.0]], [[speed_m_s, 0.0, 0.0]]
    commands = ramps((0.0, 1.0), (TILT_RAD, TILT_RAD), start=start, velocity=velocity, slid_s=slid_s)
    return np.asarray(simulate(commands, MODEL, time_s=STAMPS).path[0, :, 0])


@pytest.mark.parametrize("simulate", [in_plane, in_mujoco])
def test_a_slide_that_begins_amid_goes_on_as_the_whole(simulate: Any) -> None:
    """The push must not come once more: a block that begins to slide there is 4 mm off after 0.12 s."""
    whole = path(simulate, x_m=0.0, speed_m_s=0.01, slid_s=0.0)
    cut = int(np.searchsorted(STAMPS, CUT_S))
    fit = np.polynomial.polynomial.polyfit(STAMPS[cut - 5 : cut + 6] - STAMPS[cut], whole[cut - 5 : cut + 6], 3)
    amid, afresh = (path(simulate, x_m=whole[cut], speed_m_s=fit[1], slid_s=slid_s) for slid_s in (STAMPS[cut], 0.0))
    rest = len(STAMPS) - cut
    assert np.abs(amid[:rest] - whole[cut:]).max() < 5e-5
    assert np.abs(afresh[:rest] - whole[cut:]).max() > 1e-4

"""Sessions of a block whose friction may drop, each with its diagnosis, for tests that give a simulation to it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from station.diagnosis.diagnose import Examined, examined
from station.diagnosis.observations.setting import Setting
from station.physics.catalogue import Catalogue, catalogue
from station.physics.model import Model, Term
from station.signals.session import Signals
from station.simulators.simulator import simulator
from tests.unit.diagnosis.recorded import OPENING_RADIUS_M, golden, joined

REPEATS = 14
SCATTER = 0.06
SETTING = Setting(opening_radius_m=OPENING_RADIUS_M)
NEAR = {"kinetic_drop", "stribeck", "contact_aging"}
"""The effects that this session cannot tell from a drop, or not always."""


def known() -> Catalogue:
    return catalogue()


def model(mu_s: float, drop: float, *, scatter: float = 0.0) -> Model:
    plain = Model(mu_s=mu_s, scatter=scatter)
    return plain.with_term(Term(known()["kinetic_drop"], {"drop": drop})) if drop else plain


def simulated(truth: Model, rng: np.random.Generator | None = None) -> Signals:
    recorded, rig = golden()
    rig = replace(rig, plate=replace(rig.plate, opening_m=2 * OPENING_RADIUS_M))
    planar = simulator("planar")
    if rng is None:  # without scatter and noise each repetition is the same
        return joined([planar.repeat(recorded, truth, rig=rig)] * REPEATS)
    return joined([planar.repeat(recorded, truth, rig=rig, rng=rng) for _ in range(REPEATS)])


@cache
def session(mu_s: float, drop: float) -> Signals:
    """A session with the runs' scatter and the corners' noise."""
    return simulated(model(mu_s, drop, scatter=SCATTER), np.random.default_rng(20261342))


@cache
def recording(mu_s: float, drop: float) -> Examined:
    """The session's own diagnosis."""
    return examined(session(mu_s, drop), known(), setting=SETTING)

"""The two simulators take terms without a name from a model.toml, and make the same of them, within a tolerance."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest
import tomli_w

from station.physics.catalogue import catalogue
from station.physics.model import Model, Term, model_of_table, table_of_model
from station.physics.smooth import Harmonics, Powers, Smooth, SmoothPush, Unnamed, When
from station.simulators.mujoco.batch import simulate as in_mujoco
from station.simulators.planar.simulate import simulate as in_plane
from tests.contracts.simulated_runs import MU, apart, stamps_of, tilts

ONSET_DEG, PATH_MM = 0.02, 0.5
BOTH: frozenset[When] = frozenset({"onset", "sliding"})
TERMS: tuple[tuple[Unnamed, list[float]], ...] = (
    (Smooth("run", Powers(middle=10.0, spread=20.0, degree=2), at=BOTH), [0.04, -0.02]),
    (Smooth("direction", Harmonics(waves=(("cos", 1), ("sin", 1))), at=BOTH), [0.03, -0.04]),
    (Smooth("slide_to_block", Harmonics(waves=(("cos", 2), ("sin", 2))), at=BOTH), [0.04, 0.03]),
    (Smooth("speed", Powers(middle=0.05, spread=0.1, degree=1), at=frozenset({"sliding"})), [0.05]),
    (SmoothPush("linear"), [0.1, 0.0, -0.05, 0.15]),
)


@pytest.mark.parametrize(("effect", "numbers"), TERMS, ids=[effect.id for effect, _ in TERMS])
def test_they_agree_on_a_term_without_a_name(effect: Unnamed, numbers: list[float]) -> None:
    values = {one.name: number for one, number in zip(effect.parameters, numbers, strict=True)}
    written = tomli_w.dumps(table_of_model(Model(mu_s=MU, terms=(Term(effect, values),))))
    model = model_of_table(tomllib.loads(written), catalogue())
    commands = tilts(3)
    stamps = stamps_of(commands)
    plane, engine = (each(commands, model, time_s=stamps) for each in (in_plane, in_mujoco))
    found = apart(plane, engine)
    assert found.length_mm.max() > 2.0, "nothing slid"
    assert np.nanmax(found.onset_deg) < ONSET_DEG
    assert found.path_mm.max() < PATH_MM
    plain = apart(plane, in_plane(commands, Model(mu_s=MU), time_s=stamps))
    assert plain.onset_deg.max() > 5.0 * ONSET_DEG or plain.path_mm.max() > 2.0 * PATH_MM, "it changes nothing"

"""The same law has one prior, whether mu absorbs it or it is claimed; no other effect has any."""

from __future__ import annotations

import math

import pytest

from station.diagnosis import thresholds
from station.diagnosis.inference.fit import fit
from station.diagnosis.inference.level import levelled
from station.diagnosis.inference.parameters import Free
from station.diagnosis.likelihood.systematic import allowing_for
from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.setting import Setting
from station.physics.catalogue import catalogue
from station.physics.effect import Effect
from station.physics.model import Model
from station.physics.parameter import Parameter
from tests.unit.diagnosis.recorded import OPENING_RADIUS_M, session

SIZES = [
    (effect, parameter.name)
    for effect in catalogue().values()
    for parameter in effect.parameters
    if not parameter.is_shape
]


def _of(effect: Effect, name: str) -> Parameter:
    (found,) = (parameter for parameter in effect.parameters if parameter.name == name)
    return found


def per_unit(number: Free) -> float:
    """A number's prior precision by its own unit."""
    return number.precision / number.scale**2


@pytest.mark.parametrize(("effect", "name"), SIZES, ids=lambda one: getattr(one, "id", one))
def test_the_same_law_has_the_same_prior_under_both_its_ids(effect: Effect, name: str) -> None:
    (allowed,) = allowing_for(Model(mu_s=0.3, scatter=0.05), [effect]).terms
    claimed = Free(effect, _of(effect, name))
    as_nuisance = per_unit(Free(allowed.effect, _of(allowed.effect, name)))
    assert per_unit(claimed) == pytest.approx(as_nuisance if effect.absorbed_by_mu else 0.0)


def test_an_offset_that_nothing_tells_stays_where_it_is_plausible() -> None:
    """Without a prior it ended 11° off, by whatever noise and another law's misfit said (the range's bound)."""
    evidence = evidence_of(session(), Setting(opening_radius_m=OPENING_RADIUS_M))
    law = catalogue()["angle_scale"]
    found = fit(evidence, levelled(evidence, Model(mu_s=0.3, scatter=0.05)), [law])
    plausible = thresholds.PLAUSIBLE * _of(law, "offset_rad").typical
    assert found.sd("angle_scale", "offset_rad") == pytest.approx(plausible, rel=0.3)
    assert abs(next(t.values["offset_rad"] for t in found.model.terms if t.effect is law)) < 2.0 * plausible
    assert math.isfinite(found.log_likelihood)

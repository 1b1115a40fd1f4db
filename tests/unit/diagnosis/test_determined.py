"""A diagnosis says which numbers are known only as a combination, and which are at a bound."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from shared.messages import Sample
from station.diagnosis.inference.determined import determined
from station.diagnosis.inference.fit import Fit, fit
from station.diagnosis.inference.level import levelled
from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.table import table_evidence
from station.physics.catalogue import catalogue
from station.physics.contact import Contact
from station.physics.effect import Values
from station.physics.model import Model, Term
from station.signals.measured import Measured
from station.simulators.simulator import simulator
from tests.unit.diagnosis.recorded import OPENING_RADIUS_M, golden, joined

PER_E_FOLD, DECADES, MU_S = 0.03, 2.5, 0.3


@cache
def _strengthening() -> tuple[Evidence, Fit]:
    """24 runs whose friction grows by three per cent an e-fold, above a speed that no slide shows."""
    recorded, rig = golden()
    rig = replace(rig, plate=replace(rig.plate, opening_m=2 * OPENING_RADIUS_M))
    law = catalogue()["rate_strengthening"]
    term = Term(law, {"per_e_fold": PER_E_FOLD, "slower_decades": DECADES, "both_ways": 0.0, "creep_share": 0.5})
    model, rng = Model(mu_s=MU_S, scatter=0.03, terms=(term,)), np.random.default_rng(3)
    signals = joined([simulator("planar").repeat(recorded, model, rig=rig, rng=rng) for _ in range(8)])
    evidence = evidence_of(signals, Setting(opening_radius_m=OPENING_RADIUS_M))
    return evidence, fit(evidence, levelled(evidence, model), [law])


def _entangled() -> tuple[Evidence, Fit]:
    """The same fit, its size and shape known along a line only."""
    evidence, found = _strengthening()
    names = ("per_e_fold", "slower_decades")
    places = [k for k, one in enumerate(found.free) if one.parameter and one.parameter.name in names]
    covariance = found.covariance.copy()
    covariance[np.ix_(places, places)] = np.array([[1.0, -0.99], [-0.99, 1.0]])
    return evidence, replace(found, covariance=covariance)


def test_numbers_that_stand_for_themselves_need_no_combination() -> None:
    """The form of the law near rest, of which these slides show nothing, is no number of it here."""
    evidence, found = _strengthening()
    kept = [k for k, one in enumerate(found.free) if one.parameter is None or one.parameter.name != "both_ways"]
    fewer = replace(
        found,
        free=tuple(found.free[k] for k in kept),
        vector=found.vector[kept],
        covariance=found.covariance[np.ix_(kept, kept)],
    )
    assert determined(evidence, fewer, fewer.model.terms[-1]) == ()


def test_the_creep_below_the_limit_is_found_within_its_error() -> None:
    """Half of a thermally activated contact's creep was simulated."""
    _, found = _strengthening()
    error = found.sd("rate_strengthening", "creep_share")
    assert 0.0 < error < 0.5
    assert abs(found.model.terms[-1].values["creep_share"] - 0.5) < 3.0 * error


def test_the_slope_is_known_where_size_and_shape_are_not() -> None:
    """The slope above the cut-off speed is the size, whatever the shape."""
    evidence, found = _entangled()
    (slope,) = determined(evidence, found, found.model.terms[-1])
    assert "per e-fold" in slope.expression
    assert slope.unit == "1"
    assert slope.value == pytest.approx(PER_E_FOLD, rel=0.1)
    assert 0.0 < slope.sd <= 1.05 * found.sd("rate_strengthening", "per_e_fold")


class _Silent(type(catalogue()["rate_strengthening"])):
    """The same law, that offers no quantity of its own."""

    def derived(self, contact: Contact, values: Values) -> Mapping[str, tuple[float, str]]:
        del contact, values
        return {}


def test_of_a_law_that_offers_nothing_the_best_known_line_is_given() -> None:
    evidence, found = _entangled()
    (line,) = determined(evidence, found, Term(_Silent(), found.model.terms[-1].values))
    assert "per_e_fold" in line.expression
    assert "slower_decades" in line.expression
    size = found.sd("rate_strengthening", "per_e_fold"), found.sd("rate_strengthening", "slower_decades")
    assert 0.0 < line.sd < 0.2 * (size[0] if line.unit == "1" and line.expression.startswith("per") else size[1])


def test_numbers_that_do_not_trade_off_have_no_part_in_the_line() -> None:
    """A third number stands for itself: the line is of the first two. One of them at its bound leaves none."""
    evidence, found = _entangled()
    creep = found.model.terms[-1].values["creep_share"]
    (line,) = determined(evidence, found, Term(_Silent(), found.model.terms[-1].values))
    assert re.fullmatch(r"(per_e_fold|slower_decades) [+-] [0-9.]+ (per_e_fold|slower_decades)", line.expression)
    (same,) = determined(evidence, found, Term(_Silent(), {**found.model.terms[-1].values, "creep_share": creep + 0.1}))
    assert same.value == line.value
    bound = _with(found, "slower_decades", high=True)
    assert determined(evidence, bound, Term(_Silent(), bound.model.terms[-1].values)) == ()


def _with(found: Fit, name: str, *, high: bool) -> Fit:
    place = next(k for k, one in enumerate(found.free) if one.parameter and one.parameter.name == name)
    vector = found.vector.copy()
    vector[place] = found.free[place].high if high else found.free[place].low
    return replace(found, vector=vector)


def test_a_number_at_its_bound_says_so_and_has_an_error() -> None:
    evidence, found = _strengthening()
    held = _with(found, "slower_decades", high=True)
    assert held.at_bound("rate_strengthening", "slower_decades")
    assert not held.at_bound("rate_strengthening", "per_e_fold")
    assert held.sd("rate_strengthening", "slower_decades") > 0.0
    assert determined(evidence, held, held.model.terms[-1])


def test_a_single_number_stands_for_itself() -> None:
    evidence, found = _strengthening()
    drop = catalogue()["kinetic_drop"]
    with_drop = fit(evidence, found.model.with_term(Term(drop, drop.neutral())), [drop], noise=found.noise)
    assert determined(evidence, with_drop, next(t for t in with_drop.model.terms if t.effect == drop)) == ()


def test_without_an_onset_a_slope_is_told_as_a_coefficient_of_friction() -> None:
    """No block was seen to let go: what is relative to static friction depends on a number that nobody saw."""
    evidence, found = _strengthening()
    sliding = replace(evidence, channels=tuple(one for one in evidence.channels if one.name == "along"))
    model = found.model
    alone = fit(sliding, model, [catalogue()["rate_strengthening"]], noise=found.noise)
    (slope,) = determined(sliding, alone, alone.model.terms[-1])
    assert slope.expression.endswith("as a coefficient")
    assert slope.value == pytest.approx(PER_E_FOLD * MU_S, rel=0.15)
    assert 0.0 < slope.sd < 0.1 * slope.value


def test_a_drift_that_has_not_settled_is_told_by_its_change() -> None:
    """A steady fall of 0.2 % a row tells neither the whole fall nor its runs."""
    rng, rows = np.random.default_rng(6), 60
    friction = 0.3 * np.exp(-0.002 * np.arange(rows) + rng.normal(0.0, 0.01, rows))
    columns = {"friction_coefficient": friction, "time_s": np.linspace(0.0, 3600.0 * (rows - 1), rows)}
    seen = table_evidence(Measured(samples=(Sample(),) * rows, more=columns), Setting())
    law = catalogue()["wear"]
    found = fit(seen, levelled(seen, Model(mu_s=MU_S)).with_term(Term(law, {"fall": 0.1, "runs": 50.0})), [law])
    (change,) = determined(seen, found, found.model.terms[-1])
    assert change.expression == "change of friction from the first to the last run"
    assert change.value == pytest.approx(np.expm1(-0.002 * 59), abs=3.0 * change.sd)
    assert change.sd < 0.02

"""Laws of sliding that look alike once blocks slide are told apart by how blocks gather speed."""

from __future__ import annotations

import math
from dataclasses import fields
from functools import cache
from typing import Any

import numpy as np
import pytest

from station.diagnosis.observations.breakaway import Breakaways, Law
from station.diagnosis.observations.breakaway_law import session_law
from station.diagnosis.observations.paths import CHANGES_M_S2, Paths
from station.physics.catalogue import catalogue
from station.physics.contact import Contact
from station.physics.model import Model, Term
from tests.unit.diagnosis.test_slips import MU, Friction, looked_at, one_run

RUNS = 24
"""The number of blocks; the likelihoods of a Stribeck fall and a logarithmic one differ by 3.0 at 16, by more here."""

LAWS: dict[str, Friction] = {
    "kinetic_drop": lambda _: 0.975,
    "stribeck": lambda speed: 1.0 - 0.06 * (1.0 - math.exp(-speed / 0.03)),
    "rate_strengthening": lambda speed: 1.0 + 0.015 * math.log1p(speed / 0.003),
}
STARTS = {
    "kinetic_drop": {"drop": 0.03},
    "stribeck": {"drop": 0.03, "speed_m_s": 0.02, "exponent": 1.0, "tail": 1.0},
    "rate_strengthening": {"per_e_fold": -0.003, "slower_decades": 3.0, "both_ways": 0.0, "creep_share": 0.0},
}


def _at_rest(runs: int) -> Contact:
    values: dict[str, Any] = {each.name: np.zeros(runs) for each in fields(Contact)}
    values |= {name: np.zeros((runs, 3)) for name in ("rate_rad_s", "acceleration_rad_s2")}
    values |= {"moving": np.zeros(runs, dtype=np.bool_), "tilt_rad": np.full(runs, math.atan(MU))}
    values |= {"mass_kg": np.full(runs, 0.008), "area_m2": np.full(runs, 1e-4), "rest_s": np.full(runs, 0.4)}
    return Contact(**values)


@cache
def _paths(name: str, drag_per_s: float = 0.0) -> Paths:
    """Blocks that slide by a law; they are simulated once for all tests."""
    rng = np.random.default_rng(11)
    seen = [looked_at(one_run(LAWS[name], drag_per_s, rng)[0]) for _ in range(RUNS)]
    breakaways = Breakaways.of(seen)
    law = session_law(breakaways, drag_per_s=float(np.median([look.drag_per_s for _, look in seen])))
    return Paths.of(breakaways, _at_rest(RUNS), law)


def _term(name: str, sign: float = 1.0) -> Term:
    values = dict(STARTS[name])
    if name == "rate_strengthening":
        values["per_e_fold"] *= sign
    return Term(catalogue()[name], values)


@pytest.mark.parametrize("name", LAWS)
def test_the_law_by_which_blocks_break_away_is_the_likeliest(name: str) -> None:
    """The likeliest law leads by more than the search for the best values may be short of."""
    paths = _paths(name)
    sign = -1.0 if name == "rate_strengthening" else 1.0
    log = {other: paths.log_likelihood([_term(other, sign)]) for other in LAWS}
    others = [value for other, value in log.items() if other != name]
    # A Stribeck fall over a very small speed is a sudden one.
    short = -2.0 if name == "kinetic_drop" else 3.0
    assert log[name] > max(others) + short, log


def test_only_what_changes_how_blocks_slide_is_told() -> None:
    """The paths are left as they are by what static and sliding friction share."""
    paths = _paths("kinetic_drop")
    named = catalogue()
    patch = Term(named["friction_patch"], {**named["friction_patch"].neutral(), "slope_x": 0.1})
    film = Term(named["viscous"], {"drag_n_s_m": 0.01, "by_load": 0.0})
    model = Model(mu_s=MU, terms=(patch, film, _term("kinetic_drop")))
    assert [term.effect.id for term in paths.sliding_terms(model)] == ["viscous", "kinetic_drop"]


def test_what_changes_one_run_alone_is_no_law_of_sliding() -> None:
    """Friction that is steep across a block's way holds a little less at rest, which this run's path may show."""
    paths, one = _paths("kinetic_drop"), np.arange(RUNS) == 3
    across = np.where(one, np.pi / 2, 0.0)
    contact = paths.contact.changed(way_rad=across, down_rad=across, run=np.arange(float(RUNS)))
    patch = catalogue()["friction_patch"]
    model = Model(mu_s=MU, terms=(Term(patch, {**patch.neutral(), "slope_x": 0.2}),))
    paths = Paths(paths.breakaways, contact, paths.law)
    alone = paths.of_runs(contact.run[one])
    assert alone is not None
    assert alone.sliding_terms(model)
    assert not paths.sliding_terms(model)


def test_two_laws_that_nearly_cancel_are_found_by_how_blocks_gather_speed() -> None:
    """A fall that a drag makes up for: no window shows it, and no score would."""
    seen = [looked_at(one_run(LAWS["stribeck"], 2.0, np.random.default_rng(11))[0])]
    paths = Paths.of(Breakaways.of(seen), _at_rest(1), Law(fall=0.06, fall_speed_m_s=0.03, drag_per_s=2.0))
    film = Term(catalogue()["viscous"], {"drag_n_s_m": 0.002, "by_load": 0.0})
    terms, off_m_s2 = paths.nearest((_term("stribeck"), film))
    # Together they are that very law: nothing stays off, and a hundredth of a number shows in no path.
    assert off_m_s2 < CHANGES_M_S2
    assert terms[0].values["drop"] == pytest.approx(0.06, rel=0.01)
    assert terms[1].values["drag_n_s_m"] / 0.008 == pytest.approx(2.0, rel=0.01)

"""Blocks near their limit creep down the slope, not to and fro: that is a nuisance's mean, and no effect's."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from station.diagnosis.inference.fit import Fit, fit
from station.diagnosis.likelihood.creeping import NEAR_LIMIT
from station.diagnosis.likelihood.noise import TAILS
from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.channel import REST, Channel
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.setting import Setting
from station.physics.catalogue import catalogue
from station.physics.contact import Array
from station.physics.model import Model, Term
from tests.contracts.effect_states import views
from tests.unit.diagnosis.recorded import OPENING_RADIUS_M, session

SHARE, SCATTER = 0.5, 0.2
PLAIN = Model(mu_s=0.35)


class Crept(Channel):
    """The block's place before the slip, of blocks that have crept, too."""

    def __init__(self, still: Channel, crept_m: Array) -> None:
        super().__init__(still.rows)
        self._still, self._crept_m = still, crept_m
        self.name, self.title, self.phase, self.unit = still.name, still.title, still.phase, still.unit
        self.level_tells, self.trusted = still.level_tells, still.trusted

    def residual(self, model: Model) -> Array:
        return self._still.residual(model) + self._crept_m


@cache
def crept(*, farthest: float = 1.0) -> Evidence:
    """Blocks that crept near their limits, each by more or less, for no reason of the catalogue's.

    One of them went `farthest` times as far.
    """
    still = evidence_of(session(), Setting(opening_radius_m=OPENING_RADIUS_M))
    resting = still.channel(REST)
    assert resting is not None
    each = SHARE + SCATTER * np.random.default_rng(7).standard_normal(len(resting))
    each[np.argmax(resting.rows.astray)] *= farthest
    moved = Crept(resting, each * resting.rows.astray)
    return replace(still, channels=tuple(moved if one is resting else one for one in still.channels))


@cache
def fitted(*names: str, farthest: float = 1.0) -> Fit:
    effects = [catalogue()[name] for name in names]
    begun = [Term(one, one.neutral() | {one.parameters[0].name: one.parameters[0].typical}) for one in effects]
    return fit(crept(farthest=farthest), replace(PLAIN, terms=tuple(begun)), effects)


def share_of(found: Fit) -> float:
    return next(term.values["share"] for term in found.model.terms if term.effect.id == NEAR_LIMIT.id)


def test_it_moves_the_blocks_mark_down_the_slope_and_no_other_mark() -> None:
    view = replace(views(3, on_block=True), crept_m=np.array([0.0, 1e-4, 2e-4]))
    moved = NEAR_LIMIT.seen(view, {"share": 0.5})
    assert moved is not None
    assert moved[:, 2] == pytest.approx(np.array([0.0, 5e-5, 1e-4])[:, None] * view.down)
    assert NEAR_LIMIT.seen(replace(view, on_block=False), {"share": 0.5}) is None


def test_how_far_they_crept_is_found() -> None:
    (resting,) = (channel for channel in crept().channels if channel.name == REST)
    near = np.count_nonzero(resting.rows.astray > resting.rows.sigma)
    assert near > 5
    assert share_of(fitted()) == pytest.approx(SHARE, abs=4 * SCATTER / np.sqrt(near))


@pytest.mark.parametrize("name", ["", "presliding"])
def test_a_block_that_crept_very_far_decides_nothing(name: str) -> None:
    """One in an opened case had gone 6 mm: for its sake a law of the speed had half its size, 600 nats too low."""
    usual, one = (fitted(*filter(None, [name]), farthest=factor) for factor in (1.0, 20.0))
    assert one.noise.astray_tail[REST] == min(TAILS)
    assert share_of(one) == pytest.approx(share_of(usual), abs=0.1)


def test_nor_does_it_among_so_few_that_their_tail_is_not_known() -> None:
    """Each fold of a cross-validation has fewer runs."""
    few = crept(farthest=20.0).without(np.arange(crept().runs) % 3 == 0)
    found = fit(few, PLAIN, ())
    assert share_of(found) == pytest.approx(SHARE, abs=0.2)


@pytest.mark.parametrize("name", ["arm_vibration", "presliding", "solver_creep"])
def test_it_is_no_evidence_of_an_effect_of_which_blocks_creep(name: str) -> None:
    assert fitted(name).log_likelihood - fitted().log_likelihood < 3.0

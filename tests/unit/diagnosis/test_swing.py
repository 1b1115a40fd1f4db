"""A plate that turns about another point than told: its loads, the point that paths show, and the friction of slips."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from shared.geometry import Array
from station.diagnosis.observations.breakaway import Breakaways
from station.diagnosis.observations.breakaway_arm import PLAIN, likeliest_arm
from station.diagnosis.observations.first_look import first_look
from station.diagnosis.observations.released import Released, seen_ns
from station.diagnosis.observations.slips import Slipping
from station.physics.catalogue import catalogue
from station.physics.effect import Effect
from station.physics.model import Model, Term
from station.physics.smooth import pushes
from tests.contracts.effect_states import contacts, typical
from tests.unit.diagnosis.swung import Slid, attitude, felt, one_run

ARM_M = (0.01, -0.02, 0.06)
RUNS, MU = 16, 0.36


@cache
def session(arm_m: tuple[float, float, float], scatter: float = 0.02) -> list[Slid]:
    rng = np.random.default_rng(20261459)
    mus = MU * np.exp(rng.normal(0.0, scatter, RUNS))
    return [
        one_run(np.array(arm_m), azimuth, mu, rng) for azimuth, mu in zip(rng.uniform(-3, 3, RUNS), mus, strict=True)
    ]


def paths(slid: list[Slid]) -> Breakaways:
    looks = [(one.run, first_look(one.run)) for one in slid]
    return Breakaways.of([(run, look) for run, look in looks if look is not None])


def test_the_loads_of_another_pivot_are_those_of_the_world() -> None:
    """The plate's own axes are those of the slope here: x goes down."""
    (one, *_), arm = session(ARM_M), np.array(ARM_M)
    down = (1.0, 0.0)
    time_s = one.origin_s + one.run.grid_s[::40]
    configured, true = (np.array([felt(t, place) for t in time_s]) for place in (np.zeros(3), arm))
    at = attitude(time_s, down)
    assert one.run.swing is not None
    swing = type(one.run.swing).of(at, np.array(down), sliding=configured, resting=configured)
    pull, press = swing.loads(arm)
    assert pull == pytest.approx(true[:, 0], abs=1e-5)
    assert press == pytest.approx(-true[:, 2], abs=1e-5)


def test_the_paths_show_about_which_point_the_plate_turns() -> None:
    """To a tenth of it, from sixteen runs."""
    assert likeliest_arm(paths(session(ARM_M)), PLAIN) == pytest.approx(ARM_M, abs=6e-3)


def test_a_plate_that_turns_about_its_configured_pivot_has_no_arm() -> None:
    assert not likeliest_arm(paths(session((0.0, 0.0, 0.0))), PLAIN).any()


def test_slips_at_a_crest_of_the_push_tell_the_friction_that_held() -> None:
    """With the configured pivot the same slips seem to scatter."""
    slid = session(ARM_M)
    slips = [_slipping(one) for one in slid]
    released = _released(slips, slid)
    pivot = catalogue()["pivot_offset"]
    model = Model(mu_s=MU, terms=(Term(pivot, dict(zip(("x_m", "y_m", "z_m"), ARM_M, strict=True))),))
    reported = np.log(np.tan([slip.tilt_rad for slip in slips]))
    true = np.log([one.mu for one in slid])
    assert released.log_moved(Model(mu_s=MU)) == pytest.approx(np.zeros(RUNS))
    assert np.std(reported - true) > 0.01
    assert reported + released.log_moved(model) == pytest.approx(true, abs=3e-3)


PUSHING = [one for one in (*catalogue().values(), *pushes()) if "push" in one.acts_through()]


@pytest.mark.parametrize("effect", PUSHING, ids=lambda effect: effect.id)
def test_a_push_that_a_resting_plate_has_as_well_moves_no_friction(effect: Effect) -> None:
    """Only the pivot's push is the motion's: an arm's shaking at a slip is drawn at random, see `Effect.shaking`."""
    slid = session(ARM_M)
    released = _released([_slipping(one) for one in slid], slid)
    model = Model(mu_s=MU, terms=(Term(effect, typical(effect)),))
    moved = bool(np.any(released.log_moved(model) != 0.0))
    assert moved == (effect.id == "pivot_offset")


def _slipping(one: Slid) -> Slipping:
    """A run whose slip is known to a millisecond."""
    tried = one.slip_s + np.array([-5e-4, 5e-4])
    tilt = np.interp(tried, one.run.grid_s, np.maximum.accumulate(one.run.tilt_rad))
    return Slipping(one.run, 0, np.array([0.5, 0.5]), tried, one.slip_s, float(tilt.mean()), 1e-5)


def _released(slips: list[Slipping], slid: list[Slid]) -> Released:
    moments_s = 1e-9 * seen_ns(slips)
    downs = [one.run.swing.way for one in slid if one.run.swing]
    at = [
        attitude(one.origin_s + seconds, (float(way[0]), float(way[1])))
        for one, seconds, way in zip(slid, moments_s, downs, strict=True)
    ]

    def of_all(name: str) -> Array:
        return np.concatenate([getattr(each, name) for each in at])

    contact = contacts(
        moments_s.size,
        moving=False,
        rate_rad_s=of_all("rate_rad_s"),
        acceleration_rad_s2=of_all("acceleration_rad_s2"),
        tilt_rad=of_all("tilt_rad"),
        down_rad=of_all("down_rad"),
    )
    return Released(slips, contact, rows=np.arange(RUNS), count=RUNS)


def test_steps_are_smooth() -> None:
    """A second difference would otherwise be no acceleration."""
    bends = [np.linalg.norm(attitude(np.array([t]), (1.0, 0.0)).acceleration_rad_s2) for t in np.linspace(4, 5, 400)]
    assert max(bends) < math.radians(2.0) * 10.0 / 0.25**2

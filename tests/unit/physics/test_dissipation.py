"""Onset and way of a block on any convex curve, against a search over all ways."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from station.physics.catalogue import catalogue
from station.physics.contact import Contact
from station.physics.dissipation import held_along, support, threshold
from station.physics.model import Model, Term
from tests.contracts.effect_states import contacts, read_only

KNOWN = catalogue()
LOAD_RAD = np.radians(np.arange(0.0, 360.0, 7.5))
CURVES = [
    ("cone_artifact", {"share": 0.3}),
    ("cone_artifact", {"share": 1.0}),
    ("plate_anisotropy", {"cos2": 0.1, "sin2": 0.0, "shape": -1.0}),
    ("plate_anisotropy", {"cos2": 0.7, "sin2": -0.7, "shape": -1.0}),
    ("plate_anisotropy", {"cos2": 0.7, "sin2": -0.7, "shape": -1.5}),
    ("plate_anisotropy", {"cos2": 0.4, "sin2": -0.4, "shape": 1.0}),
    ("one_way_friction", {"cos1": 0.5, "sin1": 0.5, "pinch": 0.0, "with_block": 0.0}),
    ("one_way_friction", {"cos1": 0.5, "sin1": 0.5, "pinch": 0.0, "with_block": 1.0}),
    ("one_way_friction", {"cos1": 0.3, "sin1": 0.3, "pinch": 1.0, "with_block": 0.0}),
    ("one_way_friction", {"cos1": 0.5, "sin1": 0.5, "pinch": 1.0, "with_block": 0.0}),
    ("uneven_contact", {"x_m": 5e-3, "y_m": 0.0}),
]


def resting() -> Contact:
    """One block under loads from everywhere."""
    return contacts(len(LOAD_RAD), moving=False, speed_m_s=0.0, yaw_rad=0.2, mount_rad=0.1, area_m2=1e-4)


def model(name: str, values: dict[str, float]) -> Model:
    """mu 0.3 with one effect."""
    return Model(mu_s=0.3, terms=(Term(KNOWN[name], {**KNOWN[name].neutral(), **values}),))


@pytest.mark.parametrize(("name", "values"), CURVES)
def test_threshold_is_the_least_of_all_ways(name: str, values: dict[str, float]) -> None:
    """Corners and straight parts of the curve included."""
    state, curve = resting(), model(name, values)
    held, way = threshold(curve, state, LOAD_RAD)
    ways = np.linspace(-1.5, 1.5, 3001)
    each = [curve.friction(replace(state, way_rad=read_only(LOAD_RAD + off))) / np.cos(off) for off in ways]
    np.testing.assert_allclose(held, np.min(each, axis=0), rtol=2e-4)
    there = curve.friction(replace(state, way_rad=read_only(way))) / np.cos(way - LOAD_RAD)
    np.testing.assert_allclose(there, held, rtol=1e-12)


def test_a_round_curve_slides_where_it_is_pulled() -> None:
    """mu itself, along the load."""
    held, way = threshold(model("kinetic_drop", {"drop": 0.2}), resting(), LOAD_RAD)
    np.testing.assert_array_equal(held, np.full(len(LOAD_RAD), 0.3))
    np.testing.assert_array_equal(way, LOAD_RAD)


def test_an_ellipse_slides_towards_its_easy_axis() -> None:
    """The block slides between the load and the axis of the smaller coefficient, here y."""
    state = replace(resting(), mount_rad=np.zeros(len(LOAD_RAD)))
    load = np.full(len(LOAD_RAD), np.radians(45.0))
    _, way = threshold(model("plate_anisotropy", {"cos2": 0.4, "sin2": 0.0, "shape": -1.0}), state, load)
    assert np.all((way > np.radians(46)) & (way < np.radians(90)))


def test_support_has_the_derivatives_of_a_known_curve() -> None:
    """1 + c cos φ: −c sin φ and −c cos φ."""
    state = replace(resting(), mount_rad=np.zeros(len(LOAD_RAD)))
    here, slope, bend = support(
        model("one_way_friction", {"cos1": 0.4, "sin1": 0.0, "pinch": 0.0, "with_block": 0.0}), state, LOAD_RAD
    )
    np.testing.assert_allclose(here, 0.3 * (1 + 0.4 * np.cos(LOAD_RAD)))
    np.testing.assert_allclose(slope, -0.12 * np.sin(LOAD_RAD), atol=1e-4)
    np.testing.assert_allclose(bend, -0.12 * np.cos(LOAD_RAD), atol=1e-4)


def test_a_model_near_another_holds_along_the_ways_of_that_one_but_for_the_square_of_what_is_between_them() -> None:
    """The slopes of a fit rest on this, which is never less than the threshold itself."""
    state = resting()
    near = model("plate_anisotropy", {"cos2": 0.3, "sin2": 0.1, "shape": -1.0})
    _, way = threshold(near, state, LOAD_RAD)
    over: list[float] = []
    for step in (0.04, 0.02, 0.01):
        other = model("plate_anisotropy", {"cos2": 0.3 + step, "sin2": 0.1 - step, "shape": -1.0})
        held, _ = threshold(other, state, LOAD_RAD)
        more = held_along(other, state, LOAD_RAD, way) / held - 1.0
        assert more.min() > -1e-7
        over.append(float(more.max()))
    assert over[0] < 2 * 0.04**2
    assert over[1] == pytest.approx(over[0] / 4, rel=0.2)
    assert over[2] == pytest.approx(over[1] / 4, rel=0.2)


@pytest.mark.parametrize("sideways", [0.0, 0.4])
def test_friction_that_opposes_the_motion_steers_no_block(sideways: float) -> None:
    """It slips where the force across, the share `sideways` of h', balances the load, against h there."""
    state, curve = resting(), model("one_way_friction", {"cos1": 0.3, "sin1": -0.2, "sideways": sideways})
    held, way = threshold(curve, state, LOAD_RAD)
    here, across, bend = support(curve, replace(state, way_rad=read_only(way)), way)
    np.testing.assert_allclose(np.tan(way - LOAD_RAD), -across / here, atol=2e-4)
    np.testing.assert_allclose(held, here / np.cos(way - LOAD_RAD))
    all_of_it = support(model("one_way_friction", {"cos1": 0.3, "sin1": -0.2}), state, way)
    np.testing.assert_allclose(across, sideways * all_of_it[1], atol=1e-4)
    ahead = support(curve, state, way + 1e-3)[1] - support(curve, state, way - 1e-3)[1]
    np.testing.assert_allclose(bend, 500.0 * ahead, atol=1e-3)

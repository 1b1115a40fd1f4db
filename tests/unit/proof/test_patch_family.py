"""The patch world's key and its record of where an effect acted are read right."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from shared.rig import load_rig
from station.physics.catalogue import catalogue
from tests.proof.families.patch_world import EXACT, INEXACT, truth_of
from tests.proof.patch_world.effects import EFFECTS, KNOWN
from tests.proof.patch_world.rig import rig_toml
from tests.proof.patch_world.world import World


def entry(*names: str, tier: str = "single", size: float = 2.0) -> dict[str, Any]:
    effects = [
        {"effect": name, "catalogue": EFFECTS[name].catalogue, "also": list(EFFECTS[name].also), "strength": 1.0,
         "unit": "1", "sizes": {"onset": size, "path": 0.1}}
        for name in names
    ]  # fmt: skip
    world = {**asdict(World()), "contact": World().contact._asdict()}
    return {"case": "001", "tier": tier, "seed": 1, "effects": effects, "world": world}


def run(number: int, *, onset: float | None, slide: float | None = 0.0, mark: float = 0.0) -> dict[str, Any]:
    rest = {"from_s": 0.0, "to_s": 1.0, "path_mm": 0.0, "fiducial_begin_mm": mark}
    return {"run": number, "onset_deg": onset, "slide_mm": slide, "phases": {"rest": rest}}


def test_names_that_are_as_right_come_with_the_key():
    told = truth_of(entry("velocity_weakening"), {"velocity_weakening": [run(1, onset=0.0)]})
    assert (told.kind, told.answer, told.right) == ("single", "effects", {"stribeck", "kinetic_drop"})


def test_what_the_catalogue_lacks_keeps_its_own_name():
    told = truth_of(entry("magnet", tier="outside"), {"magnet": [run(1, onset=0.0)]})
    assert (told.kind, told.answer, told.ids) == ("outside", "other", {"magnet"})
    assert not told.ids & catalogue().keys()


@pytest.mark.parametrize(("size", "strong"), [(1.6, True), (1.2, False)])
def test_an_effect_is_strong_if_the_generators_own_size_is(size: float, strong: bool):
    (effect,) = truth_of(entry("healing", size=size), {"healing": [run(1, onset=0.0)]}).effects
    assert (effect.strong, effect.strength) == (strong, size)


def test_a_change_of_all_onsets_alike_is_no_place():
    acted = [run(number, onset=5.0 + (0.5 if number > 7 else 0.0), slide=None) for number in range(1, 11)]
    (effect,) = truth_of(entry("worn_spots"), {"worn_spots": acted}).effects
    assert effect.acted["onset", 1] == 0.0
    assert effect.acted["onset", 9] > 0.5
    assert ("slide", 1) not in effect.acted
    assert effect.acted["rest", 1] == 0.0


def test_a_turn_and_what_the_inclinometer_contradicts_are_places_too():
    turned = run(1, onset=0.0) | {"phases": {"rest": {"level_deg": 0.4}, "slide": {"yaw_deg": 3.0}}}
    (effect,) = truth_of(entry("worn_corner"), {"worn_corner": [turned]}).effects
    assert (effect.acted["slide", 1], effect.acted["pre-slip", 1]) == (3.0, 2.0)
    assert ("rest", 1) not in effect.acted


def test_a_picture_that_shifts_as_the_plate_tilts_is_no_place_of_the_level_plate():
    shifted = {"rest": {"path_mm": 0.03, "fiducial_begin_mm": 0.0, "fiducial_moved_mm": 0.1}}
    (effect,) = truth_of(entry("bending_mast"), {"bending_mast": [run(1, onset=0.0) | {"phases": shifted}]}).effects
    assert (effect.acted["rest", 1], effect.acted["pre-slip", 1]) == (0.0, 2.0)


def test_a_null_conceals_nothing():
    told = truth_of(entry(tier="null_nuisance"), {})
    assert (told.kind, told.answer, told.effects) == ("null", "none", ())


def test_every_effect_that_the_catalogue_has_is_in_one_of_the_two_tables():
    assert EXACT.keys() | INEXACT.keys() == {EFFECTS[name].catalogue for name in KNOWN}


@pytest.mark.parametrize("name", KNOWN)
def test_the_maps_name_parameters_that_the_tool_has(name: str, tmp_path: Path):
    told = truth_of(entry(name), {name: [run(1, onset=0.0)]})
    (tmp_path / "rig.toml").write_text(rig_toml(World().contact), encoding="utf-8")
    exact = EXACT.get(told.effects[0].id)
    if exact is not None:
        values = exact.to_tool(told.effects[0].parameters, told, load_rig(tmp_path / "rig.toml"))
        assert values
        assert values.keys() <= {one.name for one in catalogue()[told.effects[0].id].parameters}

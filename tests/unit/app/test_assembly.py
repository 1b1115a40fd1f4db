"""A rig file puts parts together, and says when they do not fit."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from shared.errors import UserError
from shared.rig import BlockConfig, load_rig
from station.app import assembly


def rig_text(**changes: str) -> str:
    text = assembly.simulated_rig_path().read_text(encoding="utf-8")
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    return text


def test_two_processes_on_one_port_are_named(tmp_path: Path):
    file = tmp_path / "rig.toml"
    file.write_text(rig_text(**{"7448": "7449"}), encoding="utf-8")
    with pytest.raises(UserError, match=r"\[bus\].*tcp/127.0.0.1:7449 for arm and for twin"):
        load_rig(file)


@pytest.mark.parametrize(
    "name", ["", "a b", "a/b", "<b>x</b>", 'a\\"b', "a'b", "\\u001b[2J", "a\\nb", "=1", "a|b", "a.b"]
)
def test_a_rig_has_an_id_of_letters_and_digits(tmp_path: Path, name: str):
    """The sentence said so, and quotes, control characters and markup were taken all the same."""
    file = tmp_path / "rig.toml"
    file.write_text(rig_text(**{'id = "simulated"': f'id = "{name}"'}), encoding="utf-8")
    with pytest.raises(UserError, match=r"line 3: expected letters, digits, '-' and '_' for 'id', got ") as told:
        load_rig(file)
    assert str(told.value).isprintable()


@pytest.mark.parametrize("name", ["lab1", "the-lab_2", "Prüfstand"])
def test_a_rig_is_called_by_letters_and_digits(tmp_path: Path, name: str):
    file = tmp_path / "rig.toml"
    file.write_text(rig_text(**{'id = "simulated"': f'id = "{name}"'}), encoding="utf-8")
    assert load_rig(file).id == name


def test_an_empty_endpoint_is_no_endpoint(tmp_path: Path):
    file = tmp_path / "rig.toml"
    text = rig_text(**{'"tcp/127.0.0.1:7449"': '""', '"tcp/127.0.0.1:7450"': '""'})
    file.write_text(text, encoding="utf-8")
    assert load_rig(file).bus.endpoint("twin") == ()


def test_a_block_that_is_no_cube_is_refused_by_the_twin_in_a_sentence():
    rig = dataclasses.replace(assembly.rig_from(None), block=BlockConfig(size_m=(0.02, 0.01, 0.01)))
    with pytest.raises(UserError, match=r"Expected a cube.*\(0.02, 0.01, 0.01\)"):
        assembly.twin_world(rig, seed=1, start_ns=0)


@pytest.mark.parametrize("aside_m", [0.0, 0.02])
def test_a_block_without_room_at_the_plates_middle_is_refused_by_the_twin_in_a_sentence(aside_m: float):
    """An opening that is not round is compared with the block only by the twin, which lays it at the middle."""
    rig = assembly.rig_from(None)
    corners = ((aside_m - 0.004, 0.02), (aside_m - 0.004, -0.02), (aside_m + 0.004, -0.02), (aside_m + 0.004, 0.02))
    rig = dataclasses.replace(rig, plate=dataclasses.replace(rig.plate, opening_outline_m=corners))
    with pytest.raises(UserError, match=r"Expected a block that lies at the plate's middle .*\[0.01, 0.01, 0.01\]"):
        assembly.twin_world(rig, seed=1, start_ns=0)


def test_an_opening_with_an_outline_has_no_diameter():
    """Its `opening_m`, 0.09 if nobody says another, was refused on plates of less."""
    rig = assembly.rig_from(None)
    outline = ((0.02, 0.02), (-0.02, 0.02), (-0.02, -0.02), (0.02, -0.02))
    small = dataclasses.replace(rig, plate=dataclasses.replace(rig.plate, side_m=0.05, opening_outline_m=outline))
    assert assembly.twin_world(small, seed=1, start_ns=0).block_present


def test_every_azimuth_has_a_reach_within_the_ceiling_and_the_four_directions_have_theirs():
    rig = assembly.rig_from(None)
    reach = assembly.reach_of(rig)
    ceiling = math.radians(assembly.arm_settings(rig).gate.max_tilt_deg)
    azimuths = np.random.default_rng(1).uniform(-math.pi, 3 * math.pi, 6).tolist()
    assert all(0.2 < reach(azimuth) <= ceiling for azimuth in azimuths)
    for azimuth in azimuths[:2]:
        assert reach(azimuth + 2 * math.pi) == pytest.approx(reach(azimuth), abs=1e-6)


def test_the_nominal_view_puts_the_plates_centre_into_the_images():
    rig = assembly.rig_from(None)
    geometry = assembly.nominal_geometry(rig)
    centre = np.array([(rig.camera.width_px - 1) / 2, (rig.camera.height_px - 1) / 2, 1.0])
    place = np.array(geometry.plate_from_pixel).reshape(3, 3) @ centre
    assert place[:2] / place[2] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert geometry.mm_per_px == pytest.approx(1 / rig.camera.px_per_mm)


def test_the_specimen_is_the_rig_files():
    specimen = assembly.specimen(assembly.rig_from(None))
    assert (specimen.object, specimen.plate, specimen.block_area_m2) == ("steel cube", "steel", pytest.approx(1e-4))

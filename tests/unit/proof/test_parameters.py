import inspect
import math
from dataclasses import replace
from pathlib import Path

import pytest

from shared.rig import RigConfig, load_rig
from station.physics.catalogue import catalogue
from tests.proof import parameters
from tests.proof.families.own import EXACT, INEXACT
from tests.proof.key import Truth
from tests.proof.parameters import Pull
from tests.proof.said import Said
from tests.unit.proof.made_up import claim, concealed, said, truth

RIG = """id = "bench"
[camera]
driver = "synthetic"
px_per_mm = 6.0
[mark]
side_mm = 7.5
[plate]
material = "steel"
opening_m = 0.09
[block]
name = "cube"
material = "steel"
size_m = [0.01, 0.01, 0.01]
mass_kg = 0.008
[arm]
driver = "simulated"
model = "jaco2_spherical"
"""


def pulls_of(truth: Truth, said: Said, rig: RigConfig) -> tuple[list[Pull], dict[str, str]]:
    return parameters.pulls_of(truth, said, rig, maps=EXACT, inexact=INEXACT)


@pytest.fixture
def rig(tmp_path: Path) -> RigConfig:
    (tmp_path / "rig.toml").write_text(RIG, encoding="utf-8")
    return load_rig(tmp_path / "rig.toml")


def test_every_effect_is_in_one_of_the_two_tables():
    known = {name for name, effect in catalogue().items() if effect.layer != "numerics"}
    assert EXACT.keys() | INEXACT.keys() == known
    assert not EXACT.keys() & INEXACT.keys()


def test_z_and_cover(rig: RigConfig):
    case = truth("single", concealed("viscous", drag_per_s=2.0))
    pulls, left = pulls_of(case, said(claim("viscous", drag_n_s_m=(0.020, 0.002))), rig)
    assert [pull.z for pull in pulls] == pytest.approx([2.0])
    assert not pulls[0].covered
    assert left == {}


def test_the_drag_of_a_light_block_is_compared_at_its_own_mass(rig: RigConfig):
    """The tool tells it at 8 g, with a power of the load that one mass leaves open: three z of 11 to 14 were that."""
    light = replace(rig, block=replace(rig.block, mass_kg=0.0005))
    case = truth("single", concealed("viscous", drag_per_s=4.0))
    told = claim("viscous", drag_n_s_m=(0.009, 0.001), by_load=(0.5, math.nan))
    pulls, _ = pulls_of(case, said(told), light)
    assert [pull.z for pull in pulls] == pytest.approx([(0.009 * 0.25 - 0.002) / 0.00025])
    assert pulls[0].covered


def test_an_ellipse_is_told_by_twice_its_angle(rig: RigConfig):
    case = truth(
        "single", concealed("plate_anisotropy", grain_plate=0.2, grain_plate_axis=math.pi / 4, grain_plate_shape=0.0)
    )
    pulls, _ = pulls_of(case, said(claim("plate_anisotropy", cos2=(0.0, 0.01), sin2=(0.2, 0.01))), rig)
    assert [pull.z for pull in pulls] == pytest.approx([0.0, 0.0], abs=1e-9)


def test_another_law_is_left_out_and_counted(rig: RigConfig):
    case = truth("single", concealed("stribeck", fall=0.1, fall_speed=0.02, fall_shape=1.0))
    pulls, left = pulls_of(case, said(claim("stribeck", drop=(0.1, 0.01), speed_m_s=(0.02, 0.01))), rig)
    assert pulls == []
    assert "Lorentzian" in left["stribeck"]


def test_a_wrong_name_has_no_parameters_to_judge(rig: RigConfig):
    case = truth("single", concealed("viscous", drag_per_s=2.0))
    assert pulls_of(case, said(claim("kinetic_drop", drop=(0.1, 0.01))), rig) == ([], {})


def test_the_maps_name_parameters_that_the_tool_has(rig: RigConfig):
    world = {
        "drop": 0.1, "fall": 0.1, "fall_speed": 0.02, "drag_per_s": 1.0, "wear": 0.1, "wear_runs": 20.0,
        "grain_object": 0.1, "grain_object_axis": 0.3, "grain_object_shape": 0.0, "grain_plate": 0.1,
        "grain_plate_axis": 0.2, "grain_plate_shape": 0.0, "adhesion_n": 0.01, "load_power": 0.1, "uneven_x": 1e-4,
        "uneven_y": 1e-4, "level_x": 0.01, "level_y": 0.02, "scale": 0.01, "play": 0.01, "late_s": 0.02, "sag_px": 2.0,
        "lens": 0.01, "readout_s": 0.004, "rate_gain": 0.01, "rate_speed": 0.002, "nap_plate": 0.1,
        "nap_plate_axis": 0.4,
    }  # fmt: skip
    case = truth("single", concealed("viscous"))
    for name, exact in EXACT.items():
        given = exact.to_tool(world, case, rig)
        assert given is not None, inspect.getsource(exact.to_tool)
        assert given.keys() <= {parameter.name for parameter in catalogue()[name].parameters}

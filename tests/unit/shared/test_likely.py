"""Slips of unit in a rig file, and none in files that are right."""

from __future__ import annotations

from pathlib import Path

import pytest

from shared.config import load_table, table_of
from shared.errors import UserError
from shared.rig import load_rig, rig_of_table

RIG = """\
id = "one"
[block]
size_m = {size_m}
mass_kg = {mass_kg}
[mark]
side_mm = {side_mm}
aspect = {aspect}
margin = {margin}
[plate]
side_m = {plate_m}
opening_m = {opening_m}
fiducial_side_mm = {fiducial_mm}
[camera]
px_per_mm = {px_per_mm}
height_mm = {height_mm}
"""
RIGHT = {
    "size_m": [0.01, 0.01, 0.01],
    "mass_kg": 0.00785,
    "side_mm": 7.5,
    "aspect": 1.0,
    "margin": 0.0,
    "plate_m": 0.1,
    "opening_m": 0.09,
    "fiducial_mm": 4.0,
    "px_per_mm": 6.0,
    "height_mm": 300.0,
}


def written(folder: Path, **changed: object) -> Path:
    path = folder / "rig.toml"
    path.write_text(RIG.format(**(RIGHT | changed)), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"size_m": [10.0, 10.0, 10.0]}, "[block] size_m of 0.001 to 1 m, got 10; did you mean 0.01?"),
        ({"size_m": [0.01, 0.01, 1.5]}, "[block] size_m of 0.001 to 1 m, got 1.5; did you mean 0.0015?"),
        ({"mass_kg": 7.85}, "got 7.85e+06 kg/m³ from [block] mass_kg = 7.85 and its size_m; did you mean 0.00785?"),
        ({"size_m": [1, 1, 1]}, "mass_kg = 0.00785 and its size_m; did you mean size_m = [0.01, 0.01, 0.01]?"),
        ({"size_m": [0.9, 0.9, 0.4], "mass_kg": 0.0026}, "; did you mean size_m = [0.009, 0.009, 0.004]?"),
        ({"mass_kg": 0.00001}, "got 10 kg/m³"),
        ({"size_m": [0.01, 0.01, 0.0001]}, "[block] size_m of 0.001 to 1 m, got 0.0001; did you mean 0.01?"),
        (
            {"size_m": [0.1, 0.1, 0.1], "mass_kg": 7.85},
            "a block that lies within the foam's opening of 0.09 m, got 0.141 m from corner to corner by [block] "
            "size_m = [0.1, 0.1, 0.1]; did you mean size_m = [0.01, 0.01, 0.01]?",
        ),
        ({"size_m": [1, 1, 1], "mass_kg": 7850.0}, "size_m = [1, 1, 1]; did you mean size_m = [0.01, 0.01, 0.01]?"),
        ({"opening_m": 0.01}, "opening of 0.01 m, got 0.0141 m from corner to corner"),
        ({"opening_m": 0.01}, "size_m = [0.01, 0.01, 0.01]; did you mean opening_m = 0.1?"),
        ({"opening_m": 0.9}, "opening_m of at most the plate's side_m = 0.1 m, got 0.9; did you mean 0.09?"),
        ({"opening_m": 0.009}, "[plate] opening_m of 0.01 to 3 m, got 0.009; did you mean 0.09?"),
        ({"plate_m": 0.01}, "plate's side_m = 0.01 m, got 0.09; did you mean side_m = 0.1?"),
        ({"side_mm": 75.0}, "fits on its block of 10 mm × 10 mm, got [mark] side_mm = 75; did you mean 7.5?"),
        ({"side_mm": 0.0075}, "[mark] side_mm of 1 to 10 mm, got 0.0075; did you mean 7.5?"),
        ({"side_mm": 7500.0}, "fits on its block of 10 mm × 10 mm, got [mark] side_mm = 7500; did you mean 7.5?"),
        ({"side_mm": 8.0, "aspect": 1.5}, "a mark that fits on its block"),
        ({"margin": 0.25}, "10 mm × 10 mm, got 11.25 mm × 11.25 mm from [mark] side_mm = 7.5 and margin = 0.25"),
        ({"margin": 0.25}, "which is in sides; did you mean side_mm = 6.66?"),
        ({"margin": 1.25}, "which is in sides; did you mean margin = 0.1667?"),  # mm
        ({"margin": 16.67}, "which is in sides; did you mean margin = 0.1667?"),  # per cent
        ({"side_mm": 5.0, "aspect": 1.5, "margin": 0.3}, "8 mm × 10.5 mm from [mark] side_mm = 5 and margin = 0.3"),
        ({"plate_m": 100.0}, "[plate] side_m of 0.01 to 3 m, got 100; did you mean 0.1?"),
        ({"px_per_mm": 6000.0}, "[camera] px_per_mm of 0.1 to 200 px/mm, got 6000; did you mean 6?"),
        ({"height_mm": 0.3}, "[camera] height_mm of 5 to 10000 mm, got 0.3; did you mean 300?"),
        ({"fiducial_mm": 0.004}, "[plate] fiducial_side_mm of 1 to 100 mm, got 0.004; did you mean 4?"),
        ({"size_m": [0.06, 0.06, 0.3], "mass_kg": 1.0}, "a block lower than its camera, got [block] size_m"),
        ({"size_m": [0.06, 0.06, 0.2999], "mass_kg": 1.0}, "a picture of 600 px × 600 px shows whole, got 1.35e+05 px"),
        ({"px_per_mm": 150.0}, "got 1164 px × 1164 px from [mark] side_mm = 7.5, [camera] px_per_mm = 150"),
        ({"opening_m": 90.0}, "[plate] opening_m of 0.01 to 3 m, got 90; did you mean 0.09?"),
    ],
)  # fmt: skip
def test_a_slip_is_named_with_what_was_meant(changed: dict[str, object], said: str, tmp_path: Path) -> None:
    path = written(tmp_path, **changed)
    with pytest.raises(UserError) as refused:
        load_rig(path)
    assert said in str(refused.value)
    assert str(path) in str(refused.value)
    # A rig in a recording describes what was measured.
    assert rig_of_table(load_table(path)).id == "one"


@pytest.mark.parametrize(
    "right",
    [
        {},
        {"size_m": [0.1, 0.1, 0.1], "mass_kg": 0.37, "side_mm": 80.0, "plate_m": 2.0, "opening_m": 2.0},  # tosses
        {"size_m": [0.0636, 0.0636, 0.01], "mass_kg": 0.3},  # its corners just lie within the opening
        {"plate_m": 0.09},
        {"size_m": [0.03, 0.01, 0.005], "mass_kg": 0.0016, "side_mm": 9.0, "aspect": 3.0},
        {"size_m": [0.01, 0.01, 0.01], "mass_kg": 0.02259},  # osmium
        {"side_mm": 10.05},
        {"margin": 0.1667},  # deploy/mark/mark-10mm.svg just covers its block
        {"plate_m": 1.2, "opening_m": 1.0},
        {"px_per_mm": 100.0},  # 776 px in a picture of 600 px, or 540 px where a calibration measures 70 px/mm
        {"fiducial_mm": 0.0},
    ],
)
def test_real_rigs_are_taken(right: dict[str, object], tmp_path: Path) -> None:
    assert load_rig(written(tmp_path, **right)).id == "one"


@pytest.mark.parametrize(
    "line",
    [
        "[plate]\nfiducial_side_mm = nan",
        "[plate]\nopening_outline_m = [[0.0, 0.0], [0.1, 0.0], [0.1, inf]]",
        "[mark]\nmargin = 1e300",
        "[camera]\ngain = -inf",
    ],
)
def test_numbers_beyond_all_units_are_refused_in_a_recording_too(line: str) -> None:
    with pytest.raises(UserError, match="expected a finite number of at most"):
        rig_of_table(table_of(f'id = "one"\n{line}', "rig.toml"))


LENGTHS = """
[arm]
pivot_above_plate_m = {pivot_m}
base_xyz_m = {base_m}
[arm.gate]
pivot_tolerance_m = {tolerance_m}
[arm.obstacles]
walls_m = [{wall_m}]
camera_height_m = {camera_m}
[twin.plate]
cutout_radius_m = {cutout_m}
"""
USUAL = {
    "pivot_m": 0.005,
    "base_m": [0.0, 0.0, 0.3],
    "tolerance_m": 0.003,
    "wall_m": [0.34, 0.25, 0.6, 0.6, 0.02, 0.6],
    "camera_m": 0.3,
    "cutout_m": 0.045,
}


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"pivot_m": 5}, "[arm] pivot_above_plate_m of 0.0001 to 0.3 m, got 5; did you mean 0.005?"),
        ({"pivot_m": 0.5}, "got 0.5; did you mean 0.005?"),
        ({"pivot_m": 5e-6}, "got 5e-06; did you mean 0.005?"),
        ({"base_m": [0, 0, 300]}, "[arm] base_xyz_m of at most 5 m, got 300; did you mean 0.3?"),
        ({"base_m": [-30.0, 0, 0]}, "[arm] base_xyz_m of at most 5 m, got -30; did you mean -0.3?"),
        ({"tolerance_m": 3}, "[arm.gate] pivot_tolerance_m of 1e-05 to 0.05 m, got 3; did you mean 0.003?"),
        ({"wall_m": [340, 0, 0, 1, 1, 1]}, "[arm.obstacles] walls_m of at most 20 m, got 340; did you mean 0.34?"),
        ({"camera_m": 300}, "[arm.obstacles] camera_height_m of 0.005 to 10 m, got 300; did you mean 0.3?"),
        ({"cutout_m": 45}, "[twin.plate] cutout_radius_m of 0.005 to 1.5 m, got 45; did you mean 0.045?"),
    ],
)
def test_a_length_about_the_arm_is_named_with_what_was_meant(
    changed: dict[str, object], said: str, tmp_path: Path
) -> None:
    path = written(tmp_path)
    right = path.read_text(encoding="utf-8")
    path.write_text(right + LENGTHS.format(**(USUAL | changed)), encoding="utf-8")
    with pytest.raises(UserError) as refused:
        load_rig(path)
    assert said in str(refused.value)
    path.write_text(right + LENGTHS.format(**USUAL), encoding="utf-8")
    assert load_rig(path).id == "one"


def test_fiducials_and_outlines_in_metres_and_millimetres_are_told_apart(tmp_path: Path) -> None:
    for line, said in (
        ("fiducial_place_mm = 0.042", "got 0.042; did you mean 42?"),
        ("opening_outline_m = [[40, 40], [-40, 40], [0, -40]]", "got 40; did you mean 0.04?"),
    ):
        path = written(tmp_path)
        text = path.read_text(encoding="utf-8").replace("[camera]", f"{line}\n[camera]")
        path.write_text(text, encoding="utf-8")
        with pytest.raises(UserError) as refused:
            load_rig(path)
        assert str(refused.value).endswith(said)


def test_the_rigs_that_come_along_are_taken() -> None:
    root = Path(__file__).parents[3]
    for name in ("deploy/rig.example.toml", "deploy/tilt_stage/rig.toml", "station/app/rigs/simulated.toml"):
        assert load_rig(root / name).id


@pytest.mark.parametrize(
    ("size_m", "said"),
    [
        (10, "got 10; did you mean [0.01, 0.01, 0.01]?"),
        (0.02, "got 0.02; did you mean [0.02, 0.02, 0.02]?"),
        (1e9, "got 1000000000.0"),
    ],
)
def test_a_size_that_is_one_number_is_named_with_the_three_that_were_meant(
    size_m: float, said: str, tmp_path: Path
) -> None:
    with pytest.raises(UserError) as refused:
        load_rig(written(tmp_path, size_m=size_m))
    assert str(refused.value).endswith(f"expected a list of length, width and height (m) for 'block.size_m', {said}")


def test_a_misspelt_key_is_named_with_the_one_that_was_meant(tmp_path: Path) -> None:
    path = written(tmp_path)
    path.write_text(path.read_text(encoding="utf-8").replace("mass_kg", "mas_kg"), encoding="utf-8")
    with pytest.raises(UserError) as refused:
        load_rig(path)
    assert str(refused.value).endswith("for 'block.mas_kg', got an unknown key; did you mean mass_kg?")

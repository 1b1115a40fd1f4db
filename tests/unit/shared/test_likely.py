"""Slips of unit in a rig file, and none in files that are right."""

from __future__ import annotations

from pathlib import Path

import pytest

from shared.config import load_table
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
        ({"side_mm": 0.0075}, "[mark] side_mm of 1 to 10 mm, got 0.0075; did you mean 7.5?"),
        ({"side_mm": 7500.0}, "fits on its block of 10 mm × 10 mm, got [mark] side_mm = 7500; did you mean 7.5?"),
        ({"side_mm": 8.0, "aspect": 1.5}, "a mark that fits on its block"),
        ({"plate_m": 100.0}, "[plate] side_m of 0.01 to 3 m, got 100; did you mean 0.1?"),
        ({"px_per_mm": 6000.0}, "[camera] px_per_mm of 0.1 to 200 px/mm, got 6000; did you mean 6?"),
        ({"height_mm": 0.3}, "[camera] height_mm of 5 to 10000 mm, got 0.3; did you mean 300?"),
        ({"fiducial_mm": 0.004}, "[plate] fiducial_side_mm of 1 to 100 mm, got 0.004; did you mean 4?"),
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
        {"size_m": [0.1, 0.1, 0.1], "mass_kg": 0.37, "side_mm": 80.0},  # the cube of the tosses
        {"size_m": [0.03, 0.01, 0.005], "mass_kg": 0.0016, "side_mm": 9.0, "aspect": 3.0},
        {"size_m": [0.01, 0.01, 0.01], "mass_kg": 0.02259},  # osmium
        {"side_mm": 10.05},
        {"plate_m": 1.2, "opening_m": 1.0},
        {"fiducial_mm": 0.0},
    ],
)
def test_real_rigs_are_taken(right: dict[str, object], tmp_path: Path) -> None:
    assert load_rig(written(tmp_path, **right)).id == "one"


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

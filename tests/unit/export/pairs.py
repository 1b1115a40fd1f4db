"""Measured pairs for the tests: a circle, an ellipse fixed in the plate, and one fixed in the object."""

from __future__ import annotations

import math
from pathlib import Path

from station.export import export, export_formats
from station.export.measured import MeasuredPair

STEEL_ON_WOOD = MeasuredPair(object="steel", plate="wood", mu_1=0.42, mu_2=0.42, scatter=0.1, samples=1500)
WOOD_ON_STEEL = MeasuredPair(
    object="wood", plate="steel", mu_1=0.5, mu_2=0.3, axis_rad=math.radians(30), fixed_in="plate", kinetic_ratio=0.8
)
WOOD_ON_WOOD = MeasuredPair(
    object="wood",
    plate="wood",
    mu_1=0.5,
    mu_2=0.3,
    axis_rad=math.radians(130),
    one_way=1.1,
    one_way_rad=0.5,
    other_ratio=1.2,
    misfit_rad=0.02,
    mu_1_interval=(0.49, 0.51),
    mu_2_interval=(0.29, 0.31),
    side_m=0.03,
    mass_kg=0.02,
)
PAIRS = {"steel_on_wood": STEEL_ON_WOOD, "wood_on_steel": WOOD_ON_STEEL, "wood_on_wood": WOOD_ON_WOOD}


def exported(folder: Path, name: str) -> Path:
    """The folder with these pairs in one format."""
    for file in export(list(PAIRS.values()), export_formats()[name]):
        (folder / file.name).write_text(file.text, encoding="utf-8")
    return folder

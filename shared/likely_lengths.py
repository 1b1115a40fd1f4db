"""Lengths about the arm and the plate that no rig has: slips of unit, told with the value that was probably meant.

They are read from the tables as they stand: what the arm's and the twin's tables mean is the station's own. Zero is
never doubted, as it means "none" or "at the origin", and a sign says on which side.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, cast

from shared.likely import BLOCK_M, HEIGHT_MM, PLATE_M, meant


@dataclass(frozen=True)
class Length:
    """The least and the most that a length is on any rig, and what it is on most; a coordinate has no least."""

    least: float
    most: float
    usual: float
    unit: str = "m"


_CAMERA = Length(HEIGHT_MM[0] * 1e-3, HEIGHT_MM[1] * 1e-3, 0.3)
_CORNER = Length(0.0, PLATE_M[1] / 2, 0.045)
"""A place on a plate is within half of its side; most openings have a radius of 45 mm."""

LENGTHS: Mapping[str, Length] = {
    "plate.opening_outline_m": _CORNER,
    "plate.fiducial_place_mm": Length(1.0, 1e3 * PLATE_M[1] / 2, 42.0, "mm"),
    "arm.base_xyz_m": Length(0.0, 5.0, 0.3),  # the plate is at the origin, and the longest arms reach 3 m
    "arm.pivot_above_plate_m": Length(1e-4, 0.3, 0.005),  # within the block, or as far off as the camera
    "arm.gate.pivot_tolerance_m": Length(1e-5, 0.05, 0.003),  # arms repeat to some 0.02 mm; a plate has 100 mm
    "arm.obstacles.table_m": Length(0.0, 5.0, 0.3),
    "arm.obstacles.walls_m": Length(0.0, 20.0, 0.5),  # the walls of a hall
    "arm.obstacles.plate_side_m": Length(*PLATE_M, 0.1),
    "arm.obstacles.camera_height_m": _CAMERA,
    "arm.obstacles.camera_size_m": Length(0.003, 1.0, 0.1),  # from an endoscope's to a rack
    "arm.obstacles.clearance_m": Length(1e-4, 0.2, 0.005),
    "twin.block.side_m": Length(*BLOCK_M, 0.01),
    "twin.plate.side_m": Length(*PLATE_M, 0.1),
    "twin.plate.thickness_m": Length(2e-4, 0.1, 0.005),  # from a foil to a surface plate
    "twin.plate.cutout_radius_m": Length(PLATE_M[0] / 2, PLATE_M[1] / 2, 0.045),
    "twin.plate.cutout_outline_m": _CORNER,
    "twin.plate.foam_height_m": Length(2e-4, 0.2, 0.01),
    "twin.plate.camera_height_m": _CAMERA,
    "twin.plate.fiducials_m": Length(0.0, PLATE_M[1] / 2, 0.0475),
}
"""The keys of a rig file that are asked, by table and name."""


def unlikely_lengths(file: Mapping[str, Any]) -> Iterator[str]:
    """Yields sentences on lengths beyond all rigs, each with key, value and the value that was probably meant.

    Args:
        file: the rig file's values; what is no number is passed over, as whoever reads it says so.
    """
    for key, length in LENGTHS.items():
        *path, name = key.split(".")
        for value in _numbers(_found(file, (*path, name))):
            if value and not length.least <= abs(value) <= length.most:
                yield _sentence(f"[{'.'.join(path)}] {name}", value, length)


def _sentence(key: str, value: float, length: Length) -> str:
    span = f"{length.least:g} to {length.most:g}" if length.least else f"at most {length.most:g}"
    question = meant(value, (length.least, length.most), usual=length.usual)
    return f"expected {key} of {span} {length.unit}, got {value:g}{question}"


def _found(values: Any, path: tuple[str, ...]) -> Any:
    for name in path:
        if not isinstance(values, Mapping):
            return None
        values = cast("Mapping[str, Any]", values).get(name)
    return values


def _numbers(value: Any) -> Iterator[float]:
    """Yields the numbers in a value, which may be a list of lists."""
    if isinstance(value, list):
        for one in cast("list[Any]", value):
            yield from _numbers(one)
    elif isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
        yield value

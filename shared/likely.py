"""Sizes that no rig has: slips of unit in a rig file, told with the value that was probably meant.

Only the user's own file is asked. The rig inside a recording describes what was measured, whatever it says.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

BLOCK_M = (0.001, 1.0)
"""Sides of a block, m: a camera sees no smaller mark, and no arm of a bench tilts a larger one."""

PLATE_M = (0.01, 3.0)
"""Sides of a plate and of its opening, m: from a slide of a microscope to a table."""

TILT_RAD = math.pi / 2
"""The most that a plate is tilted, rad: beyond the vertical no block lies on it."""

DENSITY_KG_M3 = (100.0, 25_000.0)
"""Densities of solids: balsa and foam have some 100 kg/m³, osmium 22 590 kg/m³."""

LEAST_MARK_MM = 1.0
"""Side of a mark, mm: at 6 px/mm a smaller one has fewer pixels than its corners need."""

SCALE_PX_MM = (0.1, 200.0)
"""Scales of a picture on the plate, px/mm: from 300 px over the largest plate to pixels of 5 µm, a microscope's."""

HEIGHT_MM = (5.0, 10_000.0)
"""Heights of a camera's pinhole above the plate, mm: from a macro lens to the ceiling of a hall."""

ROUNDED = 1.01
"""Share of a side that a mark may be longer: files say 10 mm for a block of 9.95 mm."""

SLIPS = (1e-3, 1e3, 1e-2, 1e2)
"""Factors by which units are mistaken: mm for m, m for mm, cm for m, m for cm."""

_WHITE = 0.05
"""A rim, in sides, below which it is none: half a millimetre about a mark of 10 mm is a fold of the paper."""

Range = tuple[float, float]
Sides = tuple[float, float, float]


@dataclass(frozen=True)
class MarkSize:
    """A mark's two sides, mm, and the width of its white rim in first sides."""

    sides_mm: Range
    margin: float

    @property
    def outline_mm(self) -> Range:
        """The outer sides, rim included, as `outline_mm` of the tracker has them."""
        rim_mm = 2.0 * self.margin * self.sides_mm[0]
        return self.sides_mm[0] + rim_mm, self.sides_mm[1] + rim_mm


def unlikely_view(*, px_per_mm: float, height_mm: float, fiducial_mm: float, plate_m: float) -> Iterator[str]:
    """Yields sentences on a camera's view beyond all rigs, as `unlikely` gives them.

    Args:
        px_per_mm: scale of the picture on the plate.
        height_mm: the pinhole's height above the plate.
        fiducial_mm: side of the squares in the plate's corners; 0 without any.
        plate_m: side of the plate.
    """
    yield from _outside("[camera] px_per_mm", px_per_mm, SCALE_PX_MM, "px/mm")
    yield from _outside("[camera] height_mm", height_mm, HEIGHT_MM, "mm")
    if fiducial_mm > 0:
        yield from _outside("[plate] fiducial_side_mm", fiducial_mm, (LEAST_MARK_MM, 1e3 * plate_m), "mm")


def unlikely(*, block_m: Sides, mass_kg: float, plate_m: float, opening_m: float, mark: MarkSize) -> Iterator[str]:
    """Yields sentences on sizes and masses beyond all rigs, each with key, value and what was probably meant.

    Args:
        block_m: length, width and height of the block.
        mass_kg: its mass.
        plate_m: side of the plate.
        opening_m: diameter of the foam's opening.
        mark: the mark's sides and rim.
    """
    for side in block_m:
        yield from _outside("[block] size_m", side, BLOCK_M, "m")
    yield from _outside("[plate] side_m", plate_m, PLATE_M, "m")
    yield from _outside("[plate] opening_m", opening_m, PLATE_M, "m")
    yield from _density(block_m, mass_kg)
    yield from _mark(mark, sorted(1e3 * side for side in block_m[:2]))


def sides_meant(side: float) -> str:
    """Gives the question whether a cube with such sides was meant, in the likeliest unit, for a size of one number."""
    near = (side * slip for slip in (1.0, *SLIPS))
    found = next((one for one in near if BLOCK_M[0] <= one <= BLOCK_M[1]), None)
    return "" if found is None else f"; did you mean {_listed(found, found, found)}?"


def _density(block_m: Sides, mass_kg: float) -> Iterator[str]:
    volume = math.prod(block_m)
    likely = (DENSITY_KG_M3[0] * volume, DENSITY_KG_M3[1] * volume)
    if not likely[0] <= mass_kg <= likely[1]:
        hint = meant(mass_kg, likely) or _sides_of_mass(block_m, mass_kg)
        yield (
            f"expected a block of {DENSITY_KG_M3[0]:g} to {DENSITY_KG_M3[1]:g} kg/m³, got {mass_kg / volume:.3g} kg/m³ "
            f"from [block] mass_kg = {mass_kg:g} and its size_m{hint}"
        )


def _sides_of_mass(block_m: Sides, mass_kg: float) -> str:
    """Returns the question whether the sides were meant in another unit, in which the block's density is likely."""
    near = ((slip * block_m[0], slip * block_m[1], slip * block_m[2]) for slip in SLIPS)
    found = next((sides for sides in near if _solid(sides, mass_kg)), None)
    return "" if found is None else f"; did you mean size_m = {_listed(*found)}?"


def _solid(block_m: Sides, mass_kg: float) -> bool:
    likely = DENSITY_KG_M3[0] <= mass_kg / math.prod(block_m) <= DENSITY_KG_M3[1]
    return likely and all(BLOCK_M[0] <= side <= BLOCK_M[1] for side in block_m)


def _listed(*sides: float) -> str:
    return f"[{', '.join(f'{side:.6g}' for side in sides)}]"


def _mark(mark: MarkSize, room_mm: list[float]) -> Iterator[str]:
    least = min(mark.sides_mm)
    if least < LEAST_MARK_MM:
        yield from _outside("[mark] side_mm", least, (LEAST_MARK_MM, room_mm[-1]), "mm")
    elif not _fits(mark.sides_mm, room_mm):
        side = mark.sides_mm[0]
        yield (
            f"expected a mark that fits on its block of {room_mm[0]:g} mm × {room_mm[1]:g} mm, got [mark] side_mm = "
            f"{side:g}{meant(side, (LEAST_MARK_MM, room_mm[0]))}"
        )
    elif not _fits(mark.outline_mm, room_mm):
        yield (
            f"expected a mark whose white rim fits on its block of {room_mm[0]:g} mm × {room_mm[1]:g} mm, got "
            f"{mark.outline_mm[0]:.4g} mm × {mark.outline_mm[1]:.4g} mm from [mark] side_mm = {mark.sides_mm[0]:g} and "
            f"margin = {mark.margin:g}, which is in sides{_rim_meant(mark, room_mm)}"
        )


def _fits(sides_mm: Range, room_mm: list[float]) -> bool:
    return all(side <= ROUNDED * room for side, room in zip(sorted(sides_mm), room_mm, strict=True))


def _rim_meant(mark: MarkSize, room_mm: list[float]) -> str:
    """Asks for the rim in sides, where it was probably given in mm or per cent, or else for the largest side."""
    near = (mark.margin / mark.sides_mm[0], 1e-2 * mark.margin)
    for margin in near:
        if margin >= _WHITE and _fits(replace(mark, margin=margin).outline_mm, room_mm):
            return f"; did you mean margin = {margin:.4g}?"
    grown = sorted(mark.outline_mm)
    share = min(room / side for side, room in zip(grown, room_mm, strict=True))
    return f"; did you mean side_mm = {math.floor(100 * share * mark.sides_mm[0]) / 100:g}?"


def _outside(key: str, value: float, likely: Range, unit: str) -> Iterator[str]:
    if not likely[0] <= value <= likely[1]:
        yield f"expected {key} of {likely[0]:g} to {likely[1]:g} {unit}, got {value:g}{meant(value, likely)}"


def meant(value: float, likely: Range, *, usual: float = 0.0) -> str:
    """Asks if the value was meant in another unit: the likeliest, or the one nearest to what is usual."""
    near = [value * slip for slip in SLIPS if likely[0] <= abs(value * slip) <= likely[1]]
    if not near:
        return ""
    found = min(near, key=lambda one: abs(math.log(abs(one) / usual))) if usual else near[0]
    return f"; did you mean {found:.6g}?"

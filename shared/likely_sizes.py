"""Sizes of block, mark, opening and plate that no rig has: beyond all rigs, or too large for what they belong to."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import KW_ONLY, dataclass, replace

from shared.likely import (
    BLOCK_M,
    DENSITY_KG_M3,
    HEIGHT_MM,
    LEAST_MARK_MM,
    PLATE_M,
    SCALE_PX_MM,
    SLIPS,
    Range,
    listed,
    meant,
    outside,
)

ROUNDED = 1.01
"""Share of a side that a mark may be longer: files say 10 mm for a block of 9.95 mm."""

_WHITE = 0.05
"""A rim, in sides, below which it is none: half a millimetre about a mark of 10 mm is a fold of the paper."""

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
    yield from outside("[camera] px_per_mm", px_per_mm, SCALE_PX_MM, "px/mm")
    yield from outside("[camera] height_mm", height_mm, HEIGHT_MM, "mm")
    if fiducial_mm > 0:
        yield from outside("[plate] fiducial_side_mm", fiducial_mm, (LEAST_MARK_MM, 1e3 * plate_m), "mm")


def unlikely(
    *, block_m: Sides, mass_kg: float, plate_m: float, opening_m: float, mark: MarkSize, is_round: bool = True
) -> Iterator[str]:
    """Yields sentences on sizes and masses beyond all rigs, each with key, value and what was probably meant.

    A mark fits on its block, the block in the foam's opening, and the opening on the plate.

    Args:
        block_m: length, width and height of the block.
        mass_kg: its mass.
        plate_m: side of the plate.
        opening_m: diameter of the foam's opening.
        mark: the mark's sides and rim.
        is_round: False for an opening that has an outline in place of its diameter.
    """
    room_m = opening_m if is_round else BLOCK_M[1]
    block = _Block(block_m, mass_kg, room_m=room_m, mark=mark)
    for side in block_m:
        yield from outside("[block] size_m", side, BLOCK_M, "m", fits=(BLOCK_M[0], min(BLOCK_M[1], room_m)))
    yield from outside("[plate] side_m", plate_m, PLATE_M, "m")
    yield from outside("[plate] opening_m", opening_m, PLATE_M, "m", fits=(block.across_m, plate_m))
    yield from _density(block)
    if is_round:
        yield from _opening(block, plate_m, opening_m)
    yield from _mark(mark, sorted(1e3 * side for side in block_m[:2]))


@dataclass(frozen=True)
class _Block:
    """A block with the diameter of the opening in which it lies, `room_m`, and with its mark."""

    sides_m: Sides
    mass_kg: float
    _: KW_ONLY
    room_m: float
    mark: MarkSize

    @property
    def across_m(self) -> float:
        """The distance of its farthest corners from above."""
        return math.hypot(*self.sides_m[:2])

    @property
    def volume_m3(self) -> float:
        return math.prod(self.sides_m)

    @property
    def is_solid(self) -> bool:
        return DENSITY_KG_M3[0] <= self.mass_kg / self.volume_m3 <= DENSITY_KG_M3[1]

    @property
    def fits(self) -> bool:
        """True if its sides are a block's, its mark fits on it, and it in its opening."""
        likely = all(BLOCK_M[0] <= side <= BLOCK_M[1] for side in self.sides_m) and self.across_m <= self.room_m
        return likely and fits(self.mark.sides_mm, sorted(1e3 * side for side in self.sides_m[:2]))

    def in_other_units(self) -> Iterator[_Block]:
        """Yields the blocks with these sides in other units that fit, the likeliest first."""
        length, width, height = self.sides_m
        near = (replace(self, sides_m=(slip * length, slip * width, slip * height)) for slip in SLIPS)
        yield from (block for block in near if block.fits)


def _density(block: _Block) -> Iterator[str]:
    if not block.is_solid:
        volume = block.volume_m3
        hint = meant(block.mass_kg, (DENSITY_KG_M3[0] * volume, DENSITY_KG_M3[1] * volume))
        yield (
            f"expected a block of {DENSITY_KG_M3[0]:g} to {DENSITY_KG_M3[1]:g} kg/m³, got "
            f"{block.mass_kg / volume:.3g} kg/m³ from [block] mass_kg = {block.mass_kg:g} and its size_m"
            f"{hint or _sides_meant(one for one in block.in_other_units() if one.is_solid)}"
        )


def _opening(block: _Block, plate_m: float, opening_m: float) -> Iterator[str]:
    """Yields a sentence on an opening that the plate has no room for, or that has none for the block."""
    if opening_m > plate_m:
        hint = meant(opening_m, (block.across_m, plate_m)) or meant(
            plate_m, (opening_m, PLATE_M[1]), usual=opening_m, key="side_m"
        )
        yield f"expected [plate] opening_m of at most the plate's side_m = {plate_m:g} m, got {opening_m:g}{hint}"
    elif block.across_m > opening_m:
        hint = _sides_meant(block.in_other_units()) or meant(opening_m, (block.across_m, plate_m), key="opening_m")
        yield (
            f"expected a block that lies within the foam's opening of {opening_m:g} m, got {block.across_m:.3g} m from "
            f"corner to corner by [block] size_m = {listed(*block.sides_m)}{hint}"
        )


def _sides_meant(blocks: Iterator[_Block]) -> str:
    found = next(blocks, None)
    return "" if found is None else f"; did you mean size_m = {listed(*found.sides_m)}?"


def _mark(mark: MarkSize, room_mm: list[float]) -> Iterator[str]:
    least = min(mark.sides_mm)
    if least < LEAST_MARK_MM:
        yield from outside("[mark] side_mm", least, (LEAST_MARK_MM, room_mm[-1]), "mm")
    elif not fits(mark.sides_mm, room_mm):
        side = mark.sides_mm[0]
        yield (
            f"expected a mark that fits on its block of {room_mm[0]:g} mm × {room_mm[1]:g} mm, got [mark] side_mm = "
            f"{side:g}{meant(side, (LEAST_MARK_MM, room_mm[0]))}"
        )
    elif not fits(mark.outline_mm, room_mm):
        yield (
            f"expected a mark whose white rim fits on its block of {room_mm[0]:g} mm × {room_mm[1]:g} mm, got "
            f"{mark.outline_mm[0]:.4g} mm × {mark.outline_mm[1]:.4g} mm from [mark] side_mm = {mark.sides_mm[0]:g} and "
            f"margin = {mark.margin:g}, which is in sides{_rim_meant(mark, room_mm)}"
        )


def fits(sides: Range, room: Sequence[float]) -> bool:
    """Returns true if two sides are no longer than those of the room for them, the shorter of which is the first."""
    return all(side <= ROUNDED * most for side, most in zip(sorted(sides), room, strict=True))


def _rim_meant(mark: MarkSize, room_mm: list[float]) -> str:
    """Asks for the rim in sides, where it was probably given in mm or per cent, or else for the largest side."""
    near = (mark.margin / mark.sides_mm[0], 1e-2 * mark.margin)
    for margin in near:
        if margin >= _WHITE and fits(replace(mark, margin=margin).outline_mm, room_mm):
            return f"; did you mean margin = {margin:.4g}?"
    grown = sorted(mark.outline_mm)
    share = min(room / side for side, room in zip(grown, room_mm, strict=True))
    return f"; did you mean side_mm = {math.floor(100 * share * mark.sides_mm[0]) / 100:g}?"

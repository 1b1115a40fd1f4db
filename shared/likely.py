"""Sizes that no rig has: slips of unit in a rig file, told with the value that was probably meant.

Only the user's own file is asked. The rig inside a recording describes what was measured, whatever it says.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

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

SLIPS = (1e-3, 1e3, 1e-2, 1e2, 1e-1, 1e1)
"""Factors by which units are mistaken: mm for m, m for mm, cm for m, m for cm; at last cm and mm, or a zero too few."""

Range = tuple[float, float]


def outside(key: str, value: float, likely: Range, unit: str, *, fits: Range | None = None) -> Iterator[str]:
    """Yields a sentence on a value that is not likely; asks for one that `fits` what it belongs to."""
    if not likely[0] <= value <= likely[1]:
        yield f"expected {key} of {likely[0]:g} to {likely[1]:g} {unit}, got {value:g}{meant(value, fits or likely)}"


def meant(value: float, likely: Range, *, usual: float = 0.0, key: str = "") -> str:
    """Asks if the value was meant in another unit: the likeliest, or the one nearest to what is usual.

    It names the `key`, where that is another one than was told of.
    """
    near = [value * slip for slip in SLIPS if likely[0] <= abs(value * slip) <= likely[1]]
    if not near:
        return ""
    found = min(near, key=lambda one: abs(math.log(abs(one) / usual))) if usual else near[0]
    return f"; did you mean {key and f'{key} = '}{found:.6g}?"


def sides_meant(side: float) -> str:
    """Gives the question whether a cube with such sides was meant, in the likeliest unit, for a size of one number."""
    near = (side * slip for slip in (1.0, *SLIPS))
    found = next((one for one in near if BLOCK_M[0] <= one <= BLOCK_M[1]), None)
    return "" if found is None else f"; did you mean {listed(found, found, found)}?"


def listed(*sides: float) -> str:
    """Returns sides, m, as a rig file has them."""
    return f"[{', '.join(f'{side:.6g}' for side in sides)}]"

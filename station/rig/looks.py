"""Describes the looks of a rig: the colours of its parts, and the sizes that no rig file tells."""

from __future__ import annotations

Colour = tuple[int, int, int]
"""Red, green, blue, 0 to 255."""

PLATE: Colour = (150, 156, 165)
FOAM: Colour = (70, 78, 92)
BLOCK: Colour = (214, 140, 60)
BLOCK_TOP: Colour = (30, 30, 30)
ARM: Colour = (205, 208, 214)
ARM_DARK: Colour = (105, 110, 120)

PLATE_THICKNESS_M = 0.005
FOAM_HEIGHT_M = 0.01

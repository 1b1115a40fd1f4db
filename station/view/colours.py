"""One colour for each thing, in the image, in the scene and in the plots; told apart by the colour-blind, too."""

from __future__ import annotations

from station.rig import looks

Colour = looks.Colour

# Radii below zero are points on the screen, whatever the zoom (Rerun's rule).
LINE = -1.2
DOT = -4.0

CORNERS: tuple[Colour, ...] = ((86, 180, 233), (0, 158, 115), (230, 159, 0), (204, 121, 167))
MARK: Colour = (255, 60, 200)
REFERENCE: Colour = (60, 220, 230)
THRESHOLD: Colour = (240, 80, 60)
TILT: Colour = (86, 180, 233)
COMMANDED: Colour = (150, 150, 150)
ONSET: Colour = (240, 80, 60)
PLATE: Colour = looks.PLATE
FOAM: Colour = looks.FOAM
BLOCK: Colour = looks.BLOCK
BLOCK_TOP: Colour = looks.BLOCK_TOP
SIMULATED_BEFORE: Colour = (150, 150, 150)
SIMULATED_AFTER: Colour = (0, 190, 140)
LOCATED: Colour = (230, 80, 200)
QUIET: Colour = (45, 48, 54)
ARM: Colour = looks.ARM
ARM_DARK: Colour = looks.ARM_DARK

PHASES: dict[str, Colour] = {
    "LEVEL": (110, 118, 130),
    "DWELL": (140, 120, 180),
    "REFERENCE": (60, 180, 190),
    "TILT": (70, 130, 220),
    "SLIP": (240, 80, 60),
    "SETTLE": (230, 159, 0),
    "RETURN": (90, 150, 110),
    "DONE": (60, 120, 70),
    "ABORTED": (160, 40, 90),
}
MOTION: dict[str, Colour] = {"moving": (70, 130, 220), "holding": (110, 118, 130), "fault": (240, 80, 60)}
STATION: dict[str, Colour] = {"armed": (60, 150, 80), "not armed": (110, 118, 130)}

# ruff: noqa: PLR0917 (short rows of numbers read better by place)
"""The camera sees the mark's corners and the plate's fiducial in pixels, compiled.

The camera is fixed to the plate's frame and looks straight down at its centre; image x is the plate's x, image y
its −y.
"""

from __future__ import annotations

import math
from typing import Any

from tests.concealed.compiled import compiled
from tests.concealed.world import World

CENTRE_PX = 299.5
HALF_IMAGE_PX = 300.0
IMAGE_PX = 600.0
ROW_ROUNDS = 8
"""A mark that crosses an eighth of the image during the read-out is then found in its row to 1e-7 of the image."""


@compiled
def project(world: World, x: float, y: float, height: float, down_x: float, down_y: float) -> tuple[float, float]:
    """Returns the pixel at which a point `height` above the plate is seen; (down_x, down_y): gravity along it over g.

    The camera sinks along gravity, so the picture moves uphill; the lens enlarges what is far from the centre.
    """
    grow = world.px_per_m / (1.0 - height / world.camera_height)
    u = grow * x - world.sag_px * down_x
    v = -grow * y + world.sag_px * down_y
    if world.lens != 0.0:
        more = 1.0 + world.lens * (u * u + v * v) / HALF_IMAGE_PX**2
        u, v = u * more, v * more
    return CENTRE_PX + u, CENTRE_PX + v


@compiled
def see_mark(world: World, pose: Any, speed: Any, gain: Any, down_x: float, down_y: float, corners: Any) -> None:
    """Fills `corners` (8) with the mark of a block at `pose` (x, y, yaw) with `speed` and its rate of change `gain`.

    With a rolling shutter each row is seen later than the one above it, by the read-out's time in all; a corner is seen
    when the row is read in which it then is, at the place to which speed and gain have carried it.
    """
    half = 0.5 * world.mark_side
    for i in range(4):
        sx = -half if i in (0, 3) else half
        sy = half if i < 2 else -half
        wait = 0.0
        u, v = 0.0, 0.0
        for _ in range(ROW_ROUNDS if world.readout_s != 0.0 else 1):
            yaw = pose[2] + wait * (speed[2] + 0.5 * wait * gain[2])
            c, s = math.cos(yaw), math.sin(yaw)
            x = pose[0] + wait * (speed[0] + 0.5 * wait * gain[0]) + c * sx - s * sy
            y = pose[1] + wait * (speed[1] + 0.5 * wait * gain[1]) + s * sx + c * sy
            u, v = project(world, x, y, world.mark_height, down_x, down_y)
            wait = world.readout_s * v / IMAGE_PX
        corners[2 * i], corners[2 * i + 1] = u, v


@compiled
def tip_over(world: World, azimuth: float, pose: Any, tip: float, corners: Any) -> None:
    """Moves the corners (8) of a block that has tipped by `tip` about its lower edge: shifted and foreshortened."""
    grow = world.px_per_m / (1.0 - world.mark_height / world.camera_height)
    du, dv = math.sin(azimuth), math.cos(azimuth)
    centre_u, centre_v = CENTRE_PX + grow * pose[0], CENTRE_PX - grow * pose[1]
    edge = 0.5 * world.side * grow
    for i in range(4):
        along = (corners[2 * i] - centre_u) * du + (corners[2 * i + 1] - centre_v) * dv
        now = edge + (along - edge) * math.cos(tip) + world.mark_height * grow * math.sin(tip)
        corners[2 * i] += (now - along) * du
        corners[2 * i + 1] += (now - along) * dv

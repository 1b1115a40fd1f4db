"""Holds what a view must know about the rig beyond the messages: the arm, the plate, the block, the threshold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from shared.geometry import Array
from shared.rig import RigConfig
from station.rig import looks
from station.rig.arm_model import ArmModel, forward_kinematics
from station.rig.arm_settings import arm_settings
from station.rig.placed_arm import placed_arm


@dataclass(frozen=True, kw_only=True)
class Threshold:
    """The slip rule's l = `base_px` + `per_deg_px` · θ° (paper, section III.C)."""

    base_px: float = 10.0
    per_deg_px: float = 1.0

    def at(self, tilt_deg: float) -> float:
        """Returns the threshold l in pixels."""
        return self.base_px + self.per_deg_px * tilt_deg


@dataclass(frozen=True, kw_only=True)
class Setup:
    """Shapes and places for drawing.

    `arm` is None when nothing is known of it; `world_from_base` (4, 4) says where its foot stands. Without
    `opening_m` there is no foam border; its opening is round unless `opening_outline_m` has its corners. `look_at_m` is
    the place in the world that the scene is about. `image_px` is the camera's size until a calibration tells it.
    """

    arm: ArmModel | None = None
    world_from_base: Array | None = None
    pivot_above_plate_m: float = 0.0
    plate_side_m: float = 0.1
    plate_thickness_m: float = looks.PLATE_THICKNESS_M
    opening_m: float | None = None
    opening_outline_m: tuple[tuple[float, float], ...] = ()
    foam_height_m: float = looks.FOAM_HEIGHT_M
    block_size_m: tuple[float, float, float] = (0.01, 0.01, 0.01)
    mark_side_m: float = 0.01
    mark_aspect: float = 1.0
    image_px: tuple[int, int] = (600, 600)
    look_at_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    threshold: Threshold = Threshold()


def setup_from_poses(poses: Sequence[tuple[float, float, float]]) -> Setup:
    """Returns a guess from the block's places (x, y, z of its middle, metres) when no rig file tells the shapes.

    A block rests most of the time, so a low quantile of z is half its height; it is drawn as a cube, on a plate that
    reaches a little beyond its places.
    """
    if not poses:
        return Setup()
    places = np.array(poses)
    side = 2.0 * max(float(np.quantile(places[:, 2], 0.2)), 1e-3)
    reach = float(np.abs(places[:, :2]).max()) + side
    return Setup(
        plate_side_m=2.0 * reach,
        plate_thickness_m=0.1 * side,
        block_size_m=(side, side, side),
        mark_side_m=0.8 * side,
    )


def setup_of(rig: RigConfig, *, threshold: Threshold | None = None, armed: bool = True) -> Setup:
    """Returns the shapes that a rig file describes.

    Without an arm there is neither foam border nor anything to look up at.

    Raises:
        UserError: if its `[arm]` table is wrong or names an unknown model.
    """
    shapes = Setup(
        plate_side_m=rig.plate.side_m,
        block_size_m=rig.block.size_m,
        mark_side_m=rig.mark.side_mm * 1e-3,
        mark_aspect=rig.mark.aspect,
        image_px=(rig.camera.width_px, rig.camera.height_px),
        threshold=threshold or Threshold(),
    )
    if not armed:
        return shapes
    settings = arm_settings(rig)
    placed = placed_arm(rig)
    model, world_from_base = placed.model, placed.world_from_base
    own_pivot = settings.pivot_above_plate_m
    home_rad = settings.home_rad(model.home_rad)
    x, y, z = forward_kinematics(model, home_rad, world_from_base=world_from_base)[:3, 3].tolist()
    return replace(
        shapes,
        arm=model,
        world_from_base=world_from_base,
        look_at_m=(x, y, z),
        pivot_above_plate_m=model.pivot_above_plate_m if own_pivot is None else own_pivot,
        opening_m=rig.plate.opening_m,
        opening_outline_m=rig.plate.opening_outline_m,
    )

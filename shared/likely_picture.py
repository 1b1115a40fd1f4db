"""A mark in its camera's picture: one that is larger than the picture cannot be seen, wherever the block lies.

As with other sizes beyond all rigs, only the user's own file is asked; the camera agent's tracker looks for no mark
that is longer than the picture's diagonal, whoever wrote the rig file.
"""

from __future__ import annotations

from collections.abc import Iterator

from shared.likely_sizes import MarkSize, fits

LEAST_SEEN = 0.7
"""Share of its nominal size that a mark may have in the picture: calibrations are taken whose scale is .7 of px_per_mm
(`SCALE_RANGE` in pi_agent/calibration/plate.py)."""


def unseen_block(block_m: float, *, camera_m: float) -> str:
    """Returns a sentence if the top of a block is no lower than its camera, both above the plate, m; else an empty one.

    The camera's height is the rig file's or a calibration's.
    """
    if block_m < camera_m:
        return ""
    return (
        f"expected a block lower than its camera, got [block] size_m with a height of {block_m:g} m and a camera at "
        f"{camera_m:g} m above the plate ([camera] height_mm, or its calibration); measure both again"
    )


def unlikely_picture(
    *, px_per_mm: float, height_mm: float, block_m: float, mark: MarkSize, picture_px: tuple[int, int]
) -> Iterator[str]:
    """Yields sentences on a block or a mark that the camera cannot see, as `shared.likely_sizes.unlikely` does its own.

    Args:
        px_per_mm: scale of the picture on the plate.
        height_mm: the pinhole's height above the plate.
        block_m: the block's height, on which the mark is.
        mark: the mark's sides.
        picture_px: width and height of the picture.
    """
    camera_m = 1e-3 * height_mm
    if fault := unseen_block(block_m, camera_m=camera_m):
        yield fault
        return
    nearer = 1.0 - block_m / camera_m
    width_px, height_px = (px_per_mm * side / nearer for side in mark.sides_mm)
    if not fits((LEAST_SEEN * width_px, LEAST_SEEN * height_px), sorted(picture_px)):
        yield (
            f"expected a mark that a picture of {picture_px[0]} px × {picture_px[1]} px shows whole, got "
            f"{width_px:.4g} px × {height_px:.4g} px from [mark] side_mm = {mark.sides_mm[0]:g}, [camera] px_per_mm = "
            f"{px_per_mm:g} and a block of {block_m:g} m below a camera at {height_mm:g} mm; measure these again"
        )

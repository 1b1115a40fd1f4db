"""The rig's marks as the tracker and the renderer know them."""

from __future__ import annotations

from pi_agent.tracking.mark import Mark, tag_table
from shared.errors import UserError
from shared.likely_picture import unseen_block
from shared.rig import MarkConfig, PlateConfig, RigConfig

FIDUCIAL_MARGIN = 0.25
"""Width of the white rim around a fiducial, in its sides."""


def require_visible(rig: RigConfig, *, camera_m: float) -> None:
    """Refuses a rig whose mark a camera at this height above the plate, m, cannot see or does not know.

    Raises:
        UserError: if the block is as high as the camera, or its mark is a tag that OpenCV does not have.
    """
    if fault := unseen_block(rig.block.size_m[2], camera_m=camera_m):
        raise UserError(fault[0].upper() + fault[1:])
    if rig.mark.feature == "tag":
        tag_table(rig.mark.tag_dictionary, rig.mark.tag_id)


def block_mark(config: MarkConfig) -> Mark:
    """Returns the mark on the block."""
    return Mark(
        side_mm=config.side_mm,
        aspect=config.aspect,
        margin=config.margin,
        feature=config.feature,
        tag_dictionary=config.tag_dictionary,
        tag_id=config.tag_id,
    )


def fiducial_mark(config: PlateConfig) -> Mark:
    """Returns the plain square with a white rim in each corner of the plate."""
    return Mark(side_mm=config.fiducial_side_mm, margin=FIDUCIAL_MARGIN)


def fiducial_places_mm(config: PlateConfig) -> tuple[tuple[float, float], ...]:
    """Gives the centres of the four fiducials in the plate frame (mm, y up), clockwise as seen from the upper left one.

    The fiducial at place i is reported as marker i + 1; marker 0 is the block's.
    """
    place = config.fiducial_place_mm
    return ((-place, place), (place, place), (place, -place), (-place, -place))

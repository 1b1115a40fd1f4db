"""The rig's marks as the tracker and the renderer know them."""

from __future__ import annotations

from pi_agent.tracking.mark import Mark, tag_table
from shared.rig import MarkConfig, PlateConfig

FIDUCIAL_MARGIN = 0.25
"""Width of the white rim around a fiducial, in its sides."""


def block_mark(config: MarkConfig) -> Mark:
    """Returns the mark on the block.

    Raises:
        UserError: if it is a tag that OpenCV does not have.
    """
    if config.feature == "tag":
        tag_table(config.tag_dictionary, config.tag_id)
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

"""Describes the look of a mark: a dark rectangle, its margin, and the feature that tells its corners apart.

The mark's frame has its origin at the centre of the dark square, x right and y down as the image's when the yaw is 0,
millimetres. Its corners are numbered clockwise as seen from the camera, from the one at (−, −).
"""

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from shared.errors import UserError

Points = NDArray[np.float64]
Feature = Literal["none", "dot", "notch", "tag"]

DOT_PLACE = -0.22  # centre of the dot in x and y, in sides: clear of the edges by more than the blur
DOT_RADIUS = 0.11  # in sides
NOTCH_PLACE = -0.25  # middle of the notch along the first side, in sides from the side's middle
NOTCH_SIZE = (0.12, 0.10)  # width along the side and depth, in sides
TAG_BORDER = 1  # width of a tag's dark border, in cells


@dataclass(frozen=True)
class Mark:
    """The printed or taped mark.

    `side_mm`: from corner 0 to corner 1; `aspect`: the other side over this one (the paper's rectangle-like marker
    has one above 1); `margin`: width of the white margin in `side_mm` (0 = bare tape); `feature`: what tells the
    corners apart; `tag_dictionary`, `tag_id`: for the feature "tag", a name in cv2.aruco without its DICT_ prefix.
    """

    side_mm: float = 10.0
    aspect: float = 1.0
    margin: float = 0.0
    feature: Feature = "none"
    tag_dictionary: str = "APRILTAG_16h5"
    tag_id: int = 0

    @property
    def size_mm(self) -> Points:
        """Width and height of the dark rectangle (2,)."""
        return np.array([self.side_mm, self.side_mm * self.aspect])

    def corners_mm(self) -> Points:
        """Returns the four corners (4, 2)."""
        return rectangle(self.side_mm, self.side_mm * self.aspect)

    def outline_mm(self) -> Points:
        """Returns the outermost rectangle (4, 2), margin included."""
        width, height = self.size_mm + 2.0 * self.margin * self.side_mm
        return rectangle(width, height)


def rectangle(width: float, height: float) -> Points:
    """Returns a centred rectangle (4, 2), clockwise as seen from (−, −)."""
    return 0.5 * np.array([[-width, -height], [width, -height], [width, height], [-width, height]])


def tag_table(dictionary: str, tag_id: int) -> cv2.aruco.Dictionary:
    """Returns OpenCV's table of tags `DICT_<dictionary>`.

    Raises:
        UserError: if there is none of that name, or no tag of that number in it; a recording's rig names any.
    """
    number = getattr(cv2.aruco, f"DICT_{dictionary}", None)
    if not isinstance(number, int):
        raise UserError(f"Expected the name of an OpenCV dictionary of tags such as APRILTAG_16h5, got '{dictionary}'")
    table = cv2.aruco.getPredefinedDictionary(number)
    count = len(table.bytesList)
    if not 0 <= tag_id < count:
        raise UserError(f"Expected a tag of {dictionary}, which has 0 to {count - 1}, got {tag_id}")
    return table


def tag_bits(dictionary: str, tag_id: int) -> NDArray[np.uint8]:
    """Returns the inner bits (n, n) of a tag, 1 = white, from OpenCV's table `DICT_<dictionary>`.

    Raises:
        UserError: as `tag_table`.
    """
    table = tag_table(dictionary, tag_id)
    cells = table.markerSize + 2 * TAG_BORDER
    picture = np.asarray(cv2.aruco.generateImageMarker(table, tag_id, cells))
    return (picture[TAG_BORDER:-TAG_BORDER, TAG_BORDER:-TAG_BORDER] > 127).astype(np.uint8)

"""The other methods, each as its users run it: a frame in, four corners (4, 2) or None out."""

from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Frame = NDArray[np.uint8]
Method = Callable[[Frame], Floats | None]

PAPER_THRESHOLD = 30
AREA_PX = (45.0**2, 150.0**2)


def paper(frame: Frame) -> Floats | None:
    """Threshold 30, the largest dark region of the right size, minAreaRect, whole pixels."""
    dark = cv2.threshold(frame, PAPER_THRESHOLD, 255, cv2.THRESH_BINARY_INV)[1]
    outline = _largest(dark)
    if outline is None:
        return None
    return np.asarray(cv2.boxPoints(cv2.minAreaRect(outline)), dtype=np.float64).round()


def otsu_corners(frame: Frame) -> Floats | None:
    """Otsu's threshold and a polygon of four corners."""
    dark = cv2.threshold(frame, 0, 255, cv2.THRESH_BINARY_INV | cv2.THRESH_OTSU)[1]
    outline = _largest(dark)
    if outline is None:
        return None
    polygon = cv2.approxPolyDP(outline, 0.05 * cv2.arcLength(outline, True), True)
    return polygon.reshape(4, 2).astype(np.float64) if len(polygon) == 4 else None


def corner_sub_pix(frame: Frame) -> Floats | None:
    """Otsu's corners, then cornerSubPix with a window of 5."""
    rough = otsu_corners(frame)
    if rough is None:
        return None
    stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 40, 0.001)
    fine = cv2.cornerSubPix(frame, rough.astype(np.float32).reshape(-1, 1, 2), (5, 5), (-1, -1), stop)
    return np.asarray(fine, dtype=np.float64).reshape(4, 2)


def _largest(dark: NDArray[Any]) -> NDArray[np.int32] | None:
    outlines, _ = cv2.findContours(dark, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    sized = [(cv2.contourArea(outline), number) for number, outline in enumerate(outlines)]
    fitting = [pair for pair in sized if AREA_PX[0] < pair[0] < AREA_PX[1]]
    return np.asarray(outlines[max(fitting)[1]], dtype=np.int32) if fitting else None


def aruco(refinement: str, *, dictionary: str, tag_id: int) -> Method:
    """OpenCV's detector with one of its refinements: NONE, SUBPIX, CONTOUR or APRILTAG."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = int(getattr(cv2.aruco, f"CORNER_REFINE_{refinement}"))
    table = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{dictionary}"))
    detector = cv2.aruco.ArucoDetector(table, parameters)

    def find(frame: Frame) -> Floats | None:
        quads, ids, _ = detector.detectMarkers(frame)
        numbers = [] if len(quads) == 0 else np.ravel(ids).tolist()
        for quad, number in zip(quads, numbers, strict=True):
            if int(number) == tag_id:
                return np.asarray(quad, dtype=np.float64).reshape(4, 2)
        return None

    return find

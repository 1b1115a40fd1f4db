"""Measures how sharp a picture is: by the edges of a mark, and without one by its steepest edges."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from pi_agent.cameras import Image

Floats = NDArray[np.float64]
REACH_PX, STEP_PX = 6.0, 0.25
ALONG = np.linspace(0.25, 0.75, 24)
"""The places along an edge at which it is crossed: its ends belong to the corners."""
LOWER, UPPER = 0.1587, 0.8413
"""The shares of a blurred step's height that lie two standard deviations of its blur apart."""
LEAST_STEP = 12.0
"""Grey levels: a lower step drowns in a camera's noise."""
READING = 1.0 / 12.0 + 1.0 / 6.0
"""The variance, in square pixels, that a pixel's own width and reading between pixels add to every edge."""
CALMED_PX, STEEPEST = 1.0, 0.999
"""The blur that takes the noise off, and the quantile of the slopes that is called the steepest."""


def edge_blur_px(image: Image, corners_px: Floats) -> float:
    """Returns the standard deviation of the lens's blur by a mark's edges, in pixels; NaN where no edge stands out.

    Args:
        image: the picture (height, width).
        corners_px: the mark's corners (4, 2), in order.
    """
    ends = zip(corners_px, np.roll(corners_px, -1, axis=0), strict=True)
    widths = [_width_px(_across(image, start, end)) for start, end in ends]
    known = [width for width in widths if np.isfinite(width)]
    return float(np.sqrt(max((np.median(known) / 2.0) ** 2 - READING, 0.0))) if known else float("nan")


def _across(image: Image, start: Floats, end: Floats) -> Floats:
    """Returns the mean profile across an edge, from one side to the other in steps of `STEP_PX`."""
    along = (end - start) / np.hypot(*(end - start))
    offsets = np.arange(-REACH_PX, REACH_PX + STEP_PX / 2, STEP_PX)
    at = start + ALONG[:, None, None] * (end - start) + offsets[None, :, None] * np.array([-along[1], along[0]])
    x, y = (at[..., axis].astype(np.float32) for axis in (0, 1))
    read = cv2.remap(image.astype(np.float32), x, y, cv2.INTER_LINEAR)
    return np.asarray(read.mean(axis=0), dtype=np.float64)


def _width_px(profile: Floats) -> float:
    """Returns the distance between the two shares of the step's height, along a profile with one step."""
    ends = max(round(1.0 / STEP_PX), 1)
    low, high = profile[:ends].mean(), profile[-ends:].mean()
    if abs(high - low) < LEAST_STEP:
        return float("nan")
    rising = (profile - low) / (high - low)
    return STEP_PX * (_crossing(rising, UPPER) - _crossing(rising, LOWER))


def _crossing(rising: Floats, level: float) -> float:
    """Returns the place, in steps, at which a profile that goes from 0 to 1 first reaches a level; NaN if never."""
    above = np.flatnonzero(rising >= level)
    if not len(above) or above[0] == 0:
        return float("nan")
    after = int(above[0])
    before = rising[after - 1]
    return after - 1 + float((level - before) / (rising[after] - before))


def steepness(image: Image) -> float:
    """Returns the slope of a picture's steepest edges by its contrast: it is largest in focus, whatever is seen.

    Only pictures of one scene can be compared.

    Args:
        image: the picture (height, width).
    """
    dark, bright = np.quantile(image, [1.0 - STEEPEST, STEEPEST])
    calm = cv2.GaussianBlur(image.astype(np.float32), (0, 0), CALMED_PX)
    slope = cv2.magnitude(cv2.Sobel(calm, cv2.CV_32F, 1, 0), cv2.Sobel(calm, cv2.CV_32F, 0, 1))
    return float(np.quantile(slope, STEEPEST) / (bright - dark)) if bright > dark else 0.0

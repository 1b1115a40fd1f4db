"""Measures how sharp a picture is: by the edges of a mark, and without one by its fine detail."""

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


def edge_blur_px(image: Image, corners_px: Floats) -> float:
    """The standard deviation of the blur of a mark's edges, in pixels; NaN where no edge stands out.

    Args:
        image: the picture (height, width).
        corners_px: the mark's corners (4, 2), in order.
    """
    ends = zip(corners_px, np.roll(corners_px, -1, axis=0), strict=True)
    widths = [_width_px(_across(image, start, end)) for start, end in ends]
    known = [width for width in widths if np.isfinite(width)]
    return float(np.median(known)) / 2.0 if known else float("nan")


def _across(image: Image, start: Floats, end: Floats) -> Floats:
    """The mean profile across an edge, from one side to the other in steps of `STEP_PX`."""
    along = (end - start) / np.hypot(*(end - start))
    offsets = np.arange(-REACH_PX, REACH_PX + STEP_PX / 2, STEP_PX)
    at = start + ALONG[:, None, None] * (end - start) + offsets[None, :, None] * np.array([-along[1], along[0]])
    read = cv2.remap(image.astype(np.float32), at.astype(np.float32), None, cv2.INTER_LINEAR)
    return np.asarray(read.mean(axis=0), dtype=np.float64)


def _width_px(profile: Floats) -> float:
    """The distance between the two shares of the step's height, along a profile with one step."""
    ends = max(round(1.0 / STEP_PX), 1)
    low, high = profile[:ends].mean(), profile[-ends:].mean()
    if abs(high - low) < LEAST_STEP:
        return float("nan")
    rising = (profile - low) / (high - low)
    places = [_crossing(rising, level) for level in (LOWER, UPPER)]
    return STEP_PX * (places[1] - places[0]) if None not in places else float("nan")  # type: ignore[operator]


def _crossing(rising: Floats, level: float) -> float | None:
    """The place, in steps, at which a profile that goes from 0 to 1 first reaches a level."""
    above = np.flatnonzero(rising >= level)
    if not len(above) or above[0] == 0:
        return None
    after = int(above[0])
    before = rising[after - 1]
    return after - 1 + float((level - before) / (rising[after] - before))


def fine_detail(image: Image) -> float:
    """The strength of a picture's finest detail by its contrast: it is largest in focus, whatever is seen.

    Only pictures of one scene can be compared.
    """
    spread = float(image.std())
    return float(cv2.Laplacian(image, cv2.CV_32F).std()) / spread if spread > 0 else 0.0

"""Measures the light in a picture, and says what to do about it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pi_agent.calibration.scatter import SPEEDS_M_S, TOLERATED_BLUR_PX, blur_px
from pi_agent.cameras import Image
from pi_agent.diagnosis import BLACK, WHITE, light_fault

BINS = 32
BRIGHTEST = 0.995
"""The quantile of the pixels that is called white."""
TOO_MUCH, TOO_LITTLE = 0.002, 110.0
"""The share of saturated pixels from which edges move, and the level of white below which noise does."""


@dataclass(frozen=True)
class Light:
    """The light in a picture.

    `white`: the level of its brightest part (0 to 255); `saturated` and `black`: shares of the pixels;
    `overexposed`: so many are saturated that edges move; `histogram`: shares of the pixels in `BINS` equal bins;
    `path_px`: how far a sliding block moves in the exposure.
    """

    white: float
    saturated: float
    black: float
    overexposed: bool
    histogram: tuple[float, ...]
    path_px: float
    advice: str


def light_of(image: Image, *, exposure_ms: float, px_per_mm: float) -> Light:
    """Returns the light in the picture `image` (height, width), 8-bit grey values, that was exposed so long."""
    counts = np.bincount(image.ravel(), minlength=256) / image.size
    white = float(np.searchsorted(np.cumsum(counts), BRIGHTEST))
    saturated, black = float(counts[WHITE:].sum()), float(counts[: BLACK + 1].sum())
    path_px = blur_px(exposure_ms, speed_m_s=SPEEDS_M_S[0], px_per_mm=px_per_mm)
    histogram = tuple(float(share) for share in counts.reshape(BINS, -1).sum(axis=1))
    advice = light_fault(image) or _advice(white=white, saturated=saturated, path_px=path_px)
    return Light(white, saturated, black, saturated > TOO_MUCH, histogram, path_px, advice)


def _advice(*, white: float, saturated: float, path_px: float) -> str:
    if saturated > TOO_MUCH:
        return f"{100 * saturated:.1f} % of the picture is saturated: shorten the exposure, or dim the light."
    blurred = path_px > TOLERATED_BLUR_PX
    if white < TOO_LITTLE:
        more = "add light" if blurred else "lengthen the exposure, or add light"
        return f"The brightest part reaches {white:.0f} of 255 only: {more}."
    if blurred:
        block = f"A block that slides at {SPEEDS_M_S[0]} m/s"
        return f"{block} is blurred over {path_px:.1f} px: shorten the exposure, add light."
    return "The light is good."

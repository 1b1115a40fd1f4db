"""Says in one sentence what is wrong with the picture; empty while the marker is found."""

from __future__ import annotations

import numpy as np

from pi_agent.cameras import CameraInfo, Frame, Image
from shared.messages import REPEATED, MarkerCorners

PATIENCE_NS = 500_000_000
"""A marker that is missing for less than this is nobody's fault: hands pass, blocks tumble."""
STRIDE = 8
BLACK, WHITE = 12, 250
BLACK_SHARE, WHITE_SHARE = 0.995, 0.6


class Diagnosis:
    """Watches frames and the block's corners in them."""

    def __init__(self, info: CameraInfo) -> None:
        self._shape = (info.height_px, info.width_px)
        self._missing_since_ns: int | None = None
        self.fault = ""
        """One sentence, or empty."""

    def format_fault(self, image: Image) -> str:
        """Returns the reason why a frame cannot be tracked at all; empty when it can.

        An `image` (height, width) of 8-bit grey values can, if it has the size that the camera told.
        """
        if image.dtype == np.uint8 and image.shape == self._shape:
            return ""
        wanted = f"{self._shape[1]} x {self._shape[0]} pixels of 8 bits in one grey plane"
        got = " x ".join(str(size) for size in image.shape[1::-1] + image.shape[2:])
        return f"Expected frames of {wanted}, got {got} of {image.dtype}: choose another mode or pixel format"

    def see(self, frame: Frame, corners: MarkerCorners) -> str:
        """Takes a frame with the block's corners in it; returns the fault."""
        if corners.found:
            self._missing_since_ns, self.fault = None, ""
        elif self._missing_since_ns is None:
            self._missing_since_ns = frame.capture_ns
        elif frame.capture_ns - self._missing_since_ns >= PATIENCE_NS:
            self.fault = light_fault(frame.image) or marker_fault(corners.reason)
        return self.fault


def light_fault(image: Image) -> str:
    """Says in a sentence that there is too little or too much light to see anything; empty while there is enough.

    A sample of the pixels of `image` (height, width), 8-bit grey values, is looked at.
    """
    sample = image[::STRIDE, ::STRIDE]
    level = float(sample.mean())
    dark = np.count_nonzero(sample <= BLACK) / sample.size
    bright = np.count_nonzero(sample >= WHITE) / sample.size
    if dark >= BLACK_SHARE:
        return (
            f"The picture is black (mean {level:.0f} of 255): take off the lens cap, switch on the light or lengthen "
            "exposure_ms"
        )
    if bright >= WHITE_SHARE:
        return (
            f"The picture is saturated ({100 * bright:.0f} % of it white): dim the light or shorten exposure_ms in "
            "[camera]"
        )
    return ""


def marker_fault(reason: str) -> str:
    """Returns the tracker's reason as advice."""
    if reason == REPEATED:
        return "The camera is frozen: it gives the same picture again and again; unplug it, or start the agent again"
    if "two marks" in reason:
        return "Two markers are in the picture: cover one, or give the block a mark with a feature in [mark]"
    if "leaves the frame" in reason:
        return "The marker reaches out of the picture: put the block back towards the middle of the plate"
    if "no mark" in reason:
        return (
            "No marker in the picture: is the block on the plate, in focus, and are side_mm in [mark] and px_per_mm in "
            "[camera] right?"
        )
    return f"The marker is in the picture but not trusted: {reason}"

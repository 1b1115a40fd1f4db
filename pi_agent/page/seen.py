"""One picture as the page tells of it: focus, light, and the marks in it."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from pi_agent.cameras import CameraInfo, Frame, Image
from pi_agent.diagnosis import Diagnosis
from pi_agent.observer import Observer
from pi_agent.page.edge_width import edge_blur_px, steepness
from pi_agent.page.light import Light, light_of
from shared.messages import MarkerCorners
from shared.rig import RigConfig


@dataclass(frozen=True)
class Seen:
    """One picture and what was measured in it; `blur_px` is NaN where the block's mark was not found."""

    number: int
    image: Image
    corners: MarkerCorners
    fiducials: tuple[MarkerCorners, ...]
    blur_px: float
    steepness: float
    light: Light
    fault: str

    def as_json(self) -> dict[str, Any]:
        """Returns everything but the picture itself, for JSON."""
        places = [list(one.corners_px) for one in (self.corners, *self.fiducials) if one.found]
        blur = None if math.isnan(self.blur_px) else round(self.blur_px, 3)
        height, width = self.image.shape
        return {
            "number": self.number,
            "size": [width, height],
            "mark": self.corners.found,
            "fiducials": sum(one.found for one in self.fiducials),
            "marks": places,
            "blur_px": blur,
            "steepness": round(self.steepness, 4),
            "light": asdict(self.light),
            "fault": self.fault,
        }


class Watcher:
    """Measures the pictures of one opened camera."""

    def __init__(self, rig: RigConfig, info: CameraInfo) -> None:
        self._rig, self._info = rig, info
        self._observer, self._diagnosis = Observer(rig, info), Diagnosis(info)
        self._fiducials: dict[int, MarkerCorners] = {}

    def see(self, frame: Frame, number: int) -> Seen:
        """Measures one picture; it is copied, as the driver may use its memory again."""
        image = frame.image.copy()
        corners = self._observer.block(frame)
        self._fiducials |= {one.marker_id: one for one in self._observer.plate(frame)}
        blur_px = edge_blur_px(image, np.reshape(corners.corners_px, (4, 2))) if corners.found else float("nan")
        exposure_ms = (frame.exposure_ns or self._info.exposure_ns) / 1e6
        light = light_of(image, exposure_ms=exposure_ms, px_per_mm=self._rig.camera.px_per_mm)
        fault = self._diagnosis.format_fault(image) or self._diagnosis.see(frame, corners)
        marks = tuple(self._fiducials.values())
        return Seen(number, image, corners, marks, blur_px, steepness(image), light, fault)

"""Tracks the pictures of a recording once more: what a check of its corners compares them with.

The package's entry point `repose.picture_tracker` names it, so that the station finds it without importing it. A
picture is a stranger's: its size is read from its header, and one that is not the rig file's is not unpacked.
"""

from __future__ import annotations

import numpy as np

from pi_agent.calibration.model import Calibration, nominal
from pi_agent.cameras import CameraInfo, Frame
from pi_agent.marks import require_visible
from pi_agent.observer import Observer
from pi_agent.tracking.tone import LINEAR, TONE_CURVES
from shared.config import parse, table_of
from shared.messages import MarkerCorners
from shared.pictures import size_px, unpacked
from shared.rig import RigConfig


class PictureTracker:
    """Tracks the marks of one rig, block and plate, through the pictures of one recording, in order of capture."""

    def __init__(self, rig: RigConfig, calibration_toml: str = "") -> None:
        """Takes rig file and calibration as the recording has them.

        Raises:
            UserError: if the calibration is none, or no camera sees the rig's mark.
        """
        self._rig = rig
        size = {"width_px": rig.camera.width_px, "height_px": rig.camera.height_px}
        self._calibration = _calibration(calibration_toml) if calibration_toml else nominal(rig, **size)
        require_visible(rig, camera_m=self._calibration.camera_m[2])
        self._observer: Observer | None = None
        self._capture_ns = dict[int, int]()

    def corners(self, picture: bytes, *, like: MarkerCorners) -> MarkerCorners | None:
        """Returns the corners of the mark that `like` is of, in the picture that it was seen in.

        It is None if it is no picture of the rig's camera, or the rig has no such mark.

        Only the mark's number, the capture time, the exposure and the times of the rows are taken from `like`.
        """
        frame = self._frame(picture, like)
        if frame is None:
            return None
        if self._observer is None or like.capture_ns <= self._capture_ns.get(like.marker_id, 0):
            self._observer, self._capture_ns = self._fresh(like), {}
        self._capture_ns[like.marker_id] = like.capture_ns
        return self._observer.mark(frame, like.marker_id)

    def alone(self, picture: bytes, *, like: MarkerCorners) -> MarkerCorners | None:
        """Returns the same, read without anything that earlier pictures have shown."""
        frame = self._frame(picture, like)
        return None if frame is None else self._fresh(like).mark(frame, like.marker_id)

    def _fresh(self, like: MarkerCorners) -> Observer:
        return Observer(self._rig, self._info(like), calibration=self._calibration)

    def _frame(self, picture: bytes, like: MarkerCorners) -> Frame | None:
        """Returns a picture with the capture time of `like`; None if it is none of the rig's camera."""
        size = (self._rig.camera.width_px, self._rig.camera.height_px)
        if size_px(picture) != size:
            return None
        image = unpacked(picture)
        if image is None or image.shape != size[::-1]:
            return None
        return Frame(np.asarray(image, dtype=np.uint8), like.capture_ns, like.seq)

    def _info(self, like: MarkerCorners) -> CameraInfo:
        camera = self._rig.camera
        tone = camera.options.values.get("tone", "")
        return CameraInfo(
            name="recording",
            width_px=camera.width_px,
            height_px=camera.height_px,
            rate_hz=camera.rate_hz,
            line_ns=_line_ns(like),
            exposure_ns=like.exposure_ns,
            tone=TONE_CURVES.get(str(tone), LINEAR),
            noiseless=True,  # a packed picture may be the one before again although the camera's was not
        )


def _calibration(text: str) -> Calibration:
    return parse(Calibration, table_of(text, "calibration.toml in the recording"))


def _line_ns(like: MarkerCorners) -> float:
    """Returns the time from row to row, by which the mark's corners were exposed one after another."""
    if not like.corner_dt_ns:
        return 0.0
    rows = np.array(like.corners_px[1::2])
    times = np.array(like.corner_dt_ns, dtype=np.float64)
    rows, times = rows - rows.mean(), times - times.mean()
    spread = float(rows @ rows)
    return max(0.0, float(rows @ times) / spread) if spread > 0 else 0.0

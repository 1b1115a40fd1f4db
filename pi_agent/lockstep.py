"""The camera agent in simulated time: frames rendered and tracked within the caller's own turn.

The station finds it as the entry point `synthetic` of the group `repose.lockstep_camera`, so that neither side knows
the other's code.
"""

from __future__ import annotations

import cv2
import numpy as np

from pi_agent.calibration.model import calibration_message, geometry_message, nominal
from pi_agent.cameras import Frame
from pi_agent.health import version
from pi_agent.observer import Observer
from pi_agent.synthetic_view import SyntheticOptions, SyntheticView
from shared import frames
from shared.bus import Bus
from shared.config import parse
from shared.messages import AgentStatus, TwinScene
from shared.rig import RigConfig


class PixelCamera:
    """Renders a frame at every tick, tracks it, and publishes what the camera agent would."""

    def __init__(self, bus: Bus, rig: RigConfig, *, seed: int) -> None:
        self._bus, self._rig = bus, rig
        options = parse(SyntheticOptions, rig.camera.options)
        self._view = SyntheticView(rig, rng=np.random.default_rng(seed), options=options)
        self._calibration = nominal(rig, width_px=rig.camera.width_px, height_px=rig.camera.height_px)
        self._observer = Observer(rig, self._view.info, boot_id=1)
        self._before: TwinScene | None = None
        self._seq = 0
        self._preview_ns = self._status_ns = 0

    def tick(self, now_ns: int, scene: TwinScene) -> None:
        """Takes the frame whose exposure has its middle at `now_ns`."""
        image = self._view.frame(scene, now_ns, before=self._before)
        self._before = scene
        self._seq += 1
        frame = Frame(image=image, capture_ns=now_ns, seq=self._seq, exposure_ns=self._view.info.exposure_ns, gain=1.0)
        corners = self._observer.block(frame)
        self._bus.publish("camera/corners", corners)
        for report in self._observer.plate(frame):
            self._bus.publish("camera/plate", report)
        if self._rig.camera.preview_hz > 0 and now_ns >= self._preview_ns:
            self._preview_ns = now_ns + round(1e9 / self._rig.camera.preview_hz)
            self._show(frame, corners.corners_px)
        if now_ns >= self._status_ns:
            self._status_ns = now_ns + 1_000_000_000
            self._report(now_ns)

    def _show(self, frame: Frame, corners_px: tuple[float, ...]) -> None:
        quality = [cv2.IMWRITE_JPEG_QUALITY, self._rig.camera.jpeg_quality]
        done, data = cv2.imencode(".jpg", frame.image, quality)
        if done:
            self._bus.publish("camera/image", frames.image(data.tobytes(), stamp_ns=frame.capture_ns))
            depth_m = self._calibration.camera_m[2] - self._rig.block.size_m[2]
            drawn = frames.overlay(
                corners_px, K=self._calibration.intrinsics, depth_m=depth_m, stamp_ns=frame.capture_ns
            )
            self._bus.publish("camera/image/overlay", drawn)

    def _report(self, now_ns: int) -> None:
        info = self._view.info
        status = AgentStatus(
            stamp_ns=now_ns,
            frames=self._seq,
            exposure_ns=info.exposure_ns,
            gain=info.gain,
            version=version(),
            rate_hz=info.rate_hz,
            boot_id=1,
        )
        self._bus.publish("camera/status", status)
        self._bus.publish("camera/calibration", calibration_message(self._calibration, stamp_ns=now_ns))
        self._bus.publish("camera/geometry", geometry_message(self._calibration, self._rig, stamp_ns=now_ns))

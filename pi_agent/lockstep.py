"""The camera agent in simulated time: drawn, tracked and published within the caller's own thread.

The package's entry point `repose.lockstep_camera` names it, so that a lockstep session finds it without importing it.
The same seed and the same scenes give the same messages, byte for byte.
"""

from __future__ import annotations

from collections import deque

import cv2
import numpy as np

from pi_agent.calibration.model import calibration_message, geometry_message, nominal
from pi_agent.cameras import Frame
from pi_agent.observer import Observer
from pi_agent.preview import encode
from pi_agent.synthetic_view import SyntheticOptions, SyntheticView
from shared import frames
from shared.bus import Bus
from shared.clock import SIMULATION_EPOCH_NS
from shared.config import parse
from shared.installed import version
from shared.messages import AgentStatus, MarkerCorners, TwinScene
from shared.rig import RigConfig

SECOND_NS = 1_000_000_000


class PixelCamera:
    """Publishes what the agent publishes, at the agent's rates; it serves nothing and announces nobody."""

    def __init__(self, bus: Bus, rig: RigConfig, *, seed: int) -> None:
        """Paints the plate.

        Raises:
            UserError: if the rig's camera options are not the synthetic camera's.
        """
        cv2.setNumThreads(1)
        self._bus, self._rig = bus, rig
        options = parse(SyntheticOptions, rig.camera.options)
        self._view = SyntheticView(rig, rng=np.random.default_rng(seed), options=options)
        info = self._view.info
        self._calibration = nominal(rig, width_px=info.width_px, height_px=info.height_px)
        self._depth_m = self._calibration.camera_m[2] - rig.block.size_m[2]
        self._observer = Observer(rig, info, boot_id=SIMULATION_EPOCH_NS, calibration=self._calibration)
        self._before: deque[TwinScene] = deque(maxlen=2)
        self._seq = self._preview_ns = self._report_ns = 0

    def tick(self, now_ns: int, scene: TwinScene) -> None:
        """Takes the frame whose middle row is exposed about `now_ns`."""
        image = self._view.frame(scene, now_ns, before=self._before)
        frame = Frame(image, now_ns, self._seq)
        self._before.append(scene)
        self._seq += 1
        corners = self._observer.block(frame)
        self._bus.publish("camera/corners", corners)
        for report in self._observer.plate(frame):
            self._bus.publish("camera/plate", report)
        if self._rig.camera.preview_hz > 0 and now_ns >= self._preview_ns:
            self._preview_ns = max(self._preview_ns, now_ns) + round(SECOND_NS / self._rig.camera.preview_hz)
            self._show(frame, corners)
        if now_ns >= self._report_ns:
            self._report_ns = max(self._report_ns, now_ns) + SECOND_NS
            self._report(now_ns)

    def _show(self, frame: Frame, corners: MarkerCorners) -> None:
        data = encode(frame.image, quality=self._rig.camera.jpeg_quality)
        self._bus.publish("camera/image", frames.image(data, stamp_ns=frame.capture_ns))
        matrix = self._calibration.intrinsics
        drawn = frames.overlay(corners.corners_px, K=matrix, depth_m=self._depth_m, stamp_ns=frame.capture_ns)
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
            boot_id=SIMULATION_EPOCH_NS,
        )
        self._bus.publish("camera/status", status)
        self._bus.publish("camera/calibration", calibration_message(self._calibration, stamp_ns=now_ns))
        self._bus.publish("camera/geometry", geometry_message(self._calibration, self._rig, stamp_ns=now_ns))

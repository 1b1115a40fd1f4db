"""Rigs, scenes, cameras and a twin to test the camera agent with."""

from __future__ import annotations

import dataclasses
import math
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from pi_agent.cameras import CameraInfo, Frame, Image
from shared.bus import Bus
from shared.clock import SystemClock
from shared.config import Table
from shared.errors import UserError
from shared.messages import TwinScene
from shared.rig import BlockConfig, BusConfig, CameraConfig, MarkConfig, RigConfig

SIDE_M = 0.01


def rig(*, options: dict[str, Any] | None = None, mark: MarkConfig | None = None, **camera: Any) -> RigConfig:
    return RigConfig(
        id="test",
        bus=BusConfig(camera="", arm="", station=""),
        camera=CameraConfig(**camera, options=Table(options or {}, "rig.toml", path=("camera", "options"))),
        mark=mark or MarkConfig(margin=0.16),
        block=BlockConfig(size_m=(SIDE_M, SIDE_M, SIDE_M)),
    )


def scene(x_m: float = 0.0, y_m: float = 0.0, yaw_rad: float = 0.0, *, stamp_ns: int = 0) -> TwinScene:
    return TwinScene(
        stamp_ns=stamp_ns,
        block_x_m=x_m,
        block_y_m=y_m,
        block_z_m=SIDE_M / 2,
        block_qw=math.cos(yaw_rad / 2),
        block_qz=math.sin(yaw_rad / 2),
    )


def _at_rest(_: float) -> TwinScene:
    return scene(0.003, -0.002, 0.2)


class FakeTwin:
    """Publishes scenes at 200 Hz from its own thread, as `station twin` does."""

    def __init__(self, bus: Bus, clock: SystemClock, pose: Callable[[float], TwinScene] | None = None) -> None:
        self._bus, self._clock = bus, clock
        self._pose = pose or _at_rest
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> FakeTwin:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    def _run(self) -> None:
        start = time.monotonic()
        while not self._stop.wait(0.005):
            now = self._pose(time.monotonic() - start)
            self._bus.publish("truth/scene", dataclasses.replace(now, stamp_ns=self._clock.now_ns()))


class ScriptedCamera:
    """Gives the images that it was told to, one a call, then nothing; a UserError among them is raised."""

    def __init__(self, script: list[Image | UserError | Exception], *, rate_hz: float = 90.0) -> None:
        self.script, self.opened, self.closed = list(script), 0, 0
        self._rate_hz, self._seq = rate_hz, 0
        self._clock = SystemClock()

    def open(self) -> CameraInfo:
        self.opened += 1
        self._seq = 0
        return CameraInfo(
            name="scripted", width_px=600, height_px=600, rate_hz=self._rate_hz, exposure_ns=1_000_000, noiseless=True
        )

    def read(self, timeout_s: float) -> Frame | None:
        if not self.script:
            time.sleep(timeout_s)
            return None
        time.sleep(0.5 / self._rate_hz)
        entry = self.script.pop(0)
        if isinstance(entry, Exception):
            raise entry
        self._seq += 1
        return Frame(np.asarray(entry), self._clock.now_ns(), self._seq - 1)

    def close(self) -> None:
        self.closed += 1

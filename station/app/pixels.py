"""The camera agent's camera in simulated time, in front of the twin's scenes."""

from __future__ import annotations

from typing import Protocol

from shared.bus import Bus
from shared.messages import TwinScene
from shared.rig import RigConfig
from station.app.camera_agent import borrowed
from station.app.lockstep import CameraBuilder
from station.simulators.mujoco.twin import Twin

GROUP = "repose.lockstep_camera"


class SceneCamera(Protocol):
    """The camera agent's own camera in simulated time: it is given the scene that it draws."""

    def tick(self, now_ns: int, scene: TwinScene) -> None:
        """Takes the frame whose exposure has its middle at `now_ns`, and publishes what it shows."""
        ...


class InFrontOf:
    """A `LockstepCamera` that hands a twin's scenes to the camera agent's."""

    def __init__(self, twin: Twin, camera: SceneCamera) -> None:
        self._twin, self._camera = twin, camera

    def tick(self, now_ns: int) -> None:
        """Hands the twin's scene at `now_ns` to the camera, which takes and publishes the frame."""
        self._camera.tick(now_ns, self._twin.scene(now_ns))


def pixel_camera(seed: int) -> CameraBuilder:
    """Returns a builder of the camera that renders and tracks frames in simulated time.

    Raises:
        UserError: if the camera agent is not installed here.
    """
    camera = borrowed(GROUP, "synthetic", to="for --pixels")

    def build(bus: Bus, rig: RigConfig, twin: Twin) -> InFrontOf:
        return InFrontOf(twin, camera(bus, rig, seed=seed))

    return build

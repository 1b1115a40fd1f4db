"""The rig of a case as it really is: the twin's world with what is concealed in it, the camera, and a hand."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.random import Generator

from shared.bus import Bus, Received
from shared.config import Table
from shared.messages import RunEvent, TwinScene
from shared.rig import RigConfig
from station.app import assembly
from station.app.lockstep import CameraBuilder, LockstepCamera, WorldBuilder, projected_camera
from station.app.pixels import pixel_camera
from station.arm.tilt_path import TiltStage
from station.arm.tilter import Tilter
from station.simulators.mujoco.poses import Pose
from station.simulators.mujoco.specimen import Block, Friction, Plate
from station.simulators.mujoco.twin import Twin
from station.simulators.mujoco.world import TwinWorld
from tests.frames.effects import Changes
from tests.frames.sessions import Design

ASKEW_RAD = 0.03
"""A hand that means to lay a block straight turns it by up to this angle."""


def friction_of(design: Design, mean_mu: float, changes: Changes) -> Friction:
    """The twin's own friction: mean, scatter, and perhaps an ellipse."""
    return Friction(
        mean_angle_rad=math.atan(mean_mu),
        scatter=design.scatter,
        ratio=math.exp(changes.ellipse),
        axis_rad=changes.axis_rad,
        fixed_in=changes.fixed_in,
    )


def world_builder(friction: Friction, changes: Changes) -> WorldBuilder:
    """Makes the world with what is concealed, whatever the rig file guesses of friction."""

    def build(rig: RigConfig, *, seed: int, start_ns: int, stage: TiltStage | None = None) -> TwinWorld:
        stage = stage or Tilter.from_settings(assembly.arm_settings(rig)).stage
        return TwinWorld(
            stage.model,
            friction=friction,
            rng=np.random.default_rng(seed),
            joint_start_rad=stage.home_rad.tolist(),
            block=Block(side_m=rig.block.size_m[0], mass_kg=rig.block.mass_kg),
            plate=Plate(side_m=rig.plate.side_m, cutout_radius_m=rig.plate.opening_m / 2),
            start_ns=start_ns,
            world_from_base=leaning(changes.level) @ stage.world_from_base,
            influence=changes.influence,
        )

    return build


def leaning(level: tuple[float, float]) -> np.ndarray:
    """The base's turn (4, 4) after which gravity's part along a plate that seems level is `level`, in g."""
    x, y = level
    size = math.hypot(x, y)
    turned = np.eye(4)
    if size > 0.0:
        cross = np.array([[0.0, 0.0, x], [0.0, 0.0, y], [-x, -y, 0.0]]) / size  # about (−y, x, 0)
        turned[:3, :3] += size * cross + (1.0 - math.sqrt(1.0 - size * size)) * cross @ cross
    return turned


# --- the camera -------------------------------------------------------------------------------------------------------


_Moment = tuple[Sequence[float], Pose, TwinScene]
"""A frame's plate quaternion, block pose and scene."""


@dataclass(eq=False)
class _Ago:
    """The twin as it was some frames ago, for a camera whose stamps are late: the world and the scene that it sees."""

    twin: Twin
    frames: int
    _kept: deque[_Moment] = field(default_factory=deque[_Moment])

    @property
    def world(self) -> _Ago:
        """The world that the camera without pixels looks at."""
        return self

    def take(self, now_ns: int) -> None:
        """Remembers this moment; call it at every frame."""
        world = self.twin.world
        self._kept.append((world.plate_quaternion(), world.block_pose(), self.twin.scene(now_ns)))
        if len(self._kept) > self.frames + 1:
            self._kept.popleft()

    def plate_quaternion(self) -> Sequence[float]:
        """See `SeenWorld`."""
        return self._kept[0][0]

    def block_pose(self) -> Pose:
        """See `SeenWorld`."""
        return self._kept[0][1]

    def scene(self, now_ns: int) -> TwinScene:
        """See `Twin.scene`; it says that it is of now, as the camera believes."""
        return replace(self._kept[0][2], stamp_ns=now_ns)


class _Late:
    """A camera that sees the twin as it was."""

    def __init__(self, ago: _Ago, camera: LockstepCamera) -> None:
        self._ago, self._camera = ago, camera

    def tick(self, now_ns: int) -> None:
        """See `LockstepCamera.tick`."""
        self._ago.take(now_ns)
        self._camera.tick(now_ns)


def camera_builder(design: Design, changes: Changes, *, pixels: bool, rng: Generator) -> CameraBuilder:
    """The camera, and beside it the hand, which needs the same bus and twin."""
    seed = int(rng.integers(2**31))
    plain = pixel_camera(seed) if pixels else projected_camera(seed, sigma_px=design.noise_px)

    def build(bus: Bus, rig: RigConfig, twin: Twin) -> LockstepCamera:
        bus.subscribe("session/event", Hand(design, twin.world, rng))
        options: dict[str, float] = {"sag_px": changes.sag_px} | ({"light": design.light} if pixels else {})
        real = replace(rig, camera=replace(rig.camera, options=Table(options)))
        if not changes.late:
            return plain(bus, real, twin)
        ago = _Ago(twin, changes.late)
        return _Late(ago, plain(bus, real, ago))  # pyright: ignore[reportArgumentType]  # what a camera asks of a twin

    return build


class Hand:
    """Lays the block down anew at the beginning of some runs, with the plate level."""

    def __init__(self, design: Design, world: TwinWorld, rng: Generator) -> None:
        self._design, self._world, self._rng = design, world, rng

    def __call__(self, received: Received) -> None:
        """Hears of every phase."""
        event = received.message
        if not isinstance(event, RunEvent) or event.phase != "LEVEL" or event.run % self._design.handled_every:
            return
        reach, turn = (
            self._design.placed_m * math.sqrt(float(self._rng.random())),
            float(self._rng.uniform(0.0, 2.0 * math.pi)),
        )
        most = math.pi if self._design.yaw_varies else ASKEW_RAD
        yaw = float(self._rng.uniform(-most, most))
        self._world.place_block(reach * math.cos(turn), reach * math.sin(turn), yaw)

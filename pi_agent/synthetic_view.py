"""Renders what the camera would see of the twin: a scene of `truth/scene` to pixels, without clock, thread or bus.

The plate frame's y runs up the image and the renderer's down it; that change of sign is made here, in `seen_pose`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pi_agent.cameras import CameraInfo, Image
from pi_agent.live_renderer import LiveRenderer
from pi_agent.marks import block_mark, fiducial_mark
from pi_agent.rendering import Fiducial, Optics, Pose, Scene, Sensor, surface
from pi_agent.rendering.plates import Surface
from pi_agent.rendering.scene import FRAME_PX
from pi_agent.tracking.shutter import Shutter
from pi_agent.tracking.tone import TONE_CURVES
from shared.errors import UserError
from shared.geometry import matrix_from_quaternion
from shared.messages import TwinScene
from shared.rig import RigConfig

Floats = NDArray[np.float64]
Scenes = Sequence[TwinScene]

LONGEST_STEP_NS = 100_000_000
"""Two scenes further apart than this say nothing about the block's velocity."""
LIGHT_MS = 2.0
"""The exposure to which `SyntheticOptions.light` belongs."""
LARGEST_SAG_PX = 60
"""The plate's texture does not reach further beyond the frame."""
STILL_MM_S, STILL_RAD_S = 1e-3, 1e-4
STILL = np.zeros(3)
NOISELESS = 1e-3
"""Grey levels: with more than that some of a picture's 360 000 pixels round otherwise in the next one."""
STEEPEST_RAD = 1.4
"""A mark that leans more is seen edge on, or not at all."""


@dataclass(frozen=True, kw_only=True)
class SyntheticOptions:
    """`[camera.options]` of the synthetic camera.

    `light`: level of white on the sensor at an exposure of 2 ms (1 saturates); `full_scale_e`, `read_noise_e`:
    electrons, for the noise; `blur_px`: deviation of the lens's spread; `vignetting`: share of light lost in the
    corners; `tone`: the curve of the camera's processor; `row_time_us`: from row to row with a rolling shutter;
    `sag_px`: how far the picture moves when the plate stands upright, because the camera's mount gives way.
    """

    seed: int = 1
    light: float = 0.9
    full_scale_e: float = 6000.0
    read_noise_e: float = 6.0
    blur_px: float = 0.7
    vignetting: float = 0.15
    tone: Literal["linear", "pi-default"] = "linear"
    rolling_shutter: bool = False
    row_time_us: float = 15.0
    sag_px: float = 0.0

    def __post_init__(self) -> None:
        """Refuses what no camera has."""
        if min(self.light, self.full_scale_e) <= 0 or min(self.read_noise_e, self.blur_px, self.row_time_us) < 0:
            raise ValueError("expected positive light and full_scale_e, and no negative noise, blur or row time")
        if abs(self.sag_px) > LARGEST_SAG_PX:
            raise ValueError(f"expected sag_px within ±{LARGEST_SAG_PX}, got {self.sag_px}")


class SyntheticView:
    """Draws frames of 600 × 600 pixels. The same Generator state and the same calls give the same pixels."""

    def __init__(self, rig: RigConfig, *, rng: np.random.Generator, options: SyntheticOptions | None = None) -> None:
        """Paints the plate.

        Raises:
            UserError: if the rig wants frames of another size.
        """
        settings, camera = options or SyntheticOptions(), rig.camera
        if (camera.width_px, camera.height_px) != (FRAME_PX, FRAME_PX):
            raise UserError(
                f"Expected width_px and height_px {FRAME_PX} for the synthetic camera, which draws no other size, got "
                f"{camera.width_px} and {camera.height_px}: change them in [camera]"
            )
        self._height_m = rig.block.size_m[2]
        self._sag_px = settings.sag_px
        self.info = _info(rig, settings)
        seen = _scene(rig, settings, self.info.row_times, rng=rng)
        self._renderer = LiveRenderer(seen, rng=rng, reach_px=abs(settings.sag_px))

    def frame(self, scene: TwinScene, capture_ns: int, *, before: Scenes = ()) -> Image:
        """Returns the picture (600, 600) uint8 whose middle row is exposed about `capture_ns`.

        The block moves on from `scene` as it came there from the scenes `before`, the last one last: two of them tell
        its velocity and the gain of it, one its velocity, none lets it stand still.
        """
        return self.frame_and_corners(scene, capture_ns, before=before)[0]

    def frame_and_corners(self, scene: TwinScene, capture_ns: int, *, before: Scenes = ()) -> tuple[Image, np.ndarray]:
        """Returns the picture and the mark's true corners (4, 2) in it, for tests."""
        pose = seen_pose(scene, capture_ns, before=before, block_height_m=self._height_m)
        return self._renderer.render(pose, sag_px=self._sag_of(scene))

    def _sag_of(self, scene: TwinScene) -> tuple[float, float]:
        """Returns the picture's shift: the camera sinks along gravity, so what it sees moves the other way."""
        if self._sag_px == 0.0:
            return 0.0, 0.0
        down = -matrix_from_quaternion((scene.qw, scene.qx, scene.qy, scene.qz))[2]
        return float(-self._sag_px * down[0]), float(self._sag_px * down[1])


def seen_pose(scene: TwinScene, capture_ns: int, *, before: Scenes = (), block_height_m: float) -> Pose | None:
    """Returns the mark's pose for the renderer (y down, mm) at `capture_ns`; None when the block shows no mark."""
    here = _mark_of(scene, block_height_m)
    if here is None:
        return None
    velocity = _velocity(before[-1], scene, block_height_m) if before else None
    earlier = _velocity(before[-2], before[-1], block_height_m) if len(before) > 1 else None
    velocity, gain = STILL if velocity is None else velocity, np.zeros(3)
    if earlier is not None and velocity.any():
        # Speeds are from the middle of one step to that of the next; the gain of half a step turns no block back.
        gain = (velocity - earlier) * 2e9 / (scene.stamp_ns - before[-2].stamp_ns)
        half_s = 0.5e-9 * (scene.stamp_ns - before[-1].stamp_ns)
        gain *= min(1.0, float(np.hypot(*velocity[:2]) / max(half_s * np.hypot(*gain[:2]), 1e-9)))
        velocity = velocity + gain * half_s
    x, y, yaw, tip, tip_axis = here
    ahead_s = (capture_ns - scene.stamp_ns) * 1e-9
    x, y, yaw = (np.array([x, y, yaw]) + (velocity + 0.5 * gain * ahead_s) * ahead_s).tolist()
    vx, vy, yaw_rate = (velocity + gain * ahead_s).tolist()
    gain_x, gain_y, gain_yaw = gain.tolist()
    first_s, last_s = _moves_s(complex(*velocity[:2].tolist()), complex(gain_x, gain_y))
    moves_s = first_s - ahead_s, last_s - ahead_s
    return Pose(x, y, yaw, vx, vy, yaw_rate, tip, tip_axis, (gain_x, gain_y, gain_yaw), moves_s)


def _velocity(before: TwinScene, scene: TwinScene, block_height_m: float) -> Floats | None:
    """Gives the mark's velocity from one scene to the next: mm/s and rad/s (3,); None where it was not seen in both."""
    step_ns = scene.stamp_ns - before.stamp_ns
    last, here = _mark_of(before, block_height_m), _mark_of(scene, block_height_m)
    if last is None or here is None or not 0 < step_ns <= LONGEST_STEP_NS:
        return None
    yaw = math.remainder(here[2] - last[2], 2 * math.pi)
    velocity = np.array([here[0] - last[0], here[1] - last[1], yaw]) * 1e9 / step_ns
    still = np.hypot(*velocity[:2]) < STILL_MM_S and abs(velocity[2]) < STILL_RAD_S
    return STILL if still else velocity


def _moves_s(velocity: complex, gain: complex) -> tuple[float, float]:
    """Gives the times between which a block moves: since it began to, or until it has lost its speed, but not back."""
    if gain == 0.0:
        return -math.inf, math.inf
    along = (velocity.conjugate() * gain).real
    still_s = -along / abs(gain) ** 2
    return (still_s, math.inf) if along > 0.0 else (-math.inf, still_s)


def _mark_of(scene: TwinScene, block_height_m: float) -> tuple[float, float, float, float, float] | None:
    """Returns x, y (mm), yaw, lean and the axis of the lean (rad) of the mark on the block, in the renderer's frame."""
    attitude = (scene.block_qw, scene.block_qx, scene.block_qy, scene.block_qz)
    normal = matrix_from_quaternion(attitude)[:, 2]
    tip_rad = math.atan2(math.hypot(normal[0], normal[1]), normal[2])
    if scene.block_z_m < 0 or tip_rad > STEEPEST_RAD:
        return None
    x = scene.block_x_m + 0.5 * block_height_m * normal[0]
    y = scene.block_y_m + 0.5 * block_height_m * normal[1]
    yaw = 2.0 * math.atan2(scene.block_qz, scene.block_qw)  # the twist of a swing-twist decomposition
    yaw = math.remainder(yaw, 2 * math.pi)
    tip_axis = math.atan2(normal[0], normal[1]) if tip_rad > 1e-6 else 0.0
    return 1e3 * float(x), -1e3 * float(y), -yaw, tip_rad if tip_rad > 1e-6 else 0.0, tip_axis


def _info(rig: RigConfig, options: SyntheticOptions) -> CameraInfo:
    rolling = options.rolling_shutter
    return CameraInfo(
        name="synthetic camera",
        width_px=FRAME_PX,
        height_px=FRAME_PX,
        rate_hz=rig.camera.rate_hz,
        shutter="rolling" if rolling else "global",
        line_ns=1e3 * options.row_time_us if rolling else 0.0,
        exposure_ns=round(1e6 * rig.camera.exposure_ms),
        gain=rig.camera.gain,
        tone=TONE_CURVES[options.tone],
        details="drawn from the twin's truth/scene",
        noiseless=_white_noise(options) < NOISELESS,
    )


def _white_noise(options: SyntheticOptions) -> float:
    """Returns the deviation of a white pixel, in grey levels: photons and reading."""
    return 255.0 * math.hypot(math.sqrt(options.full_scale_e), options.read_noise_e) / options.full_scale_e


def _scene(rig: RigConfig, options: SyntheticOptions, shutter: Shutter, *, rng: np.random.Generator) -> Scene:
    camera, plate = rig.camera, rig.plate
    kind: Surface = "wood" if plate.material == "wood" else "steel" if plate.material == "steel" else "plain"
    place, side = plate.fiducial_place_mm, fiducial_mark(plate)
    return Scene(
        plate=surface(kind, rng=rng),
        mark=block_mark(rig.mark),
        mark_height_mm=1e3 * rig.block.size_m[2],
        fiducials=tuple(
            Fiducial(x * place, y * place, mark=side) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1)) if place > 0
        ),
        optics=Optics(
            px_per_mm=camera.px_per_mm,
            height_mm=camera.height_mm,
            blur_px=options.blur_px,
            vignetting=options.vignetting,
        ),
        shutter=shutter,
        sensor=Sensor(options.full_scale_e, options.read_noise_e, TONE_CURVES[options.tone]),
        light=options.light * camera.exposure_ms / LIGHT_MS,
    )

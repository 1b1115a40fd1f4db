"""Describes what the camera looks at, and through what: frozen descriptions without any drawing.

Image frame: pixels, the centre of the top-left pixel is (0, 0), x right, y down. Plate frame: origin at the plate's
centre, x and y along the image's x and y, z towards the camera, millimetres. Yaw turns x towards y.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pi_agent.rendering.marks import Ink, Layer
from pi_agent.rendering.plates import Plate
from pi_agent.tracking.mark import Mark
from pi_agent.tracking.shutter import Shutter
from pi_agent.tracking.tone import LINEAR, ToneCurve

FRAME_PX = 600
"""Width and height of every frame."""


@dataclass(frozen=True)
class Pose:
    """The place of the mark's centre at the capture time (plate frame, mm, rad) and its motion (per second).

    `tip_rad` leans the mark about the horizontal axis at `tip_axis_rad` through its centre, as a tipping block does.
    `gain`: by how much `vx_mm_s`, `vy_mm_s` and `yaw_rate_rad_s` grow in a second; `moves_s`: the times after the
    capture between which it moves; before and after it lies where it is then.
    """

    x_mm: float = 0.0
    y_mm: float = 0.0
    yaw_rad: float = 0.0
    vx_mm_s: float = 0.0
    vy_mm_s: float = 0.0
    yaw_rate_rad_s: float = 0.0
    tip_rad: float = 0.0
    tip_axis_rad: float = 0.0
    gain: tuple[float, float, float] = (0.0, 0.0, 0.0)
    moves_s: tuple[float, float] = (-math.inf, math.inf)

    @property
    def is_still(self) -> bool:
        """True if all rows of a frame see the same pose."""
        return self.vx_mm_s == 0 and self.vy_mm_s == 0 and self.yaw_rate_rad_s == 0 and not any(self.gain)


@dataclass(frozen=True)
class Optics:
    """A pinhole over the plate's centre with blur, vignetting and one radial term.

    `px_per_mm` holds on the plate's plane; `height_mm`: pinhole above the plate; `blur_px`: deviation of the Gaussian
    spread; `vignetting`: fraction of light lost in the frame's corners; `tilt_rad`: the camera's two small rotations;
    `radial`: relative displacement r → r (1 + radial (r / 300 px)²).
    """

    px_per_mm: float = 6.0
    height_mm: float = 300.0
    centre_px: tuple[float, float] = (299.5, 299.5)
    blur_px: float = 0.7
    vignetting: float = 0.15
    tilt_rad: tuple[float, float] = (0.0, 0.0)
    radial: float = 0.0


@dataclass(frozen=True)
class Sensor:
    """Electrons at full scale (shot noise), read noise in electrons, and the processor's tone curve."""

    full_scale_e: float = 6000.0
    read_noise_e: float = 6.0
    tone: ToneCurve = LINEAR


@dataclass(frozen=True)
class Glare:
    """A highlight on the image: centre and radius (px), added light at its middle (1 = full scale)."""

    x_px: float
    y_px: float
    radius_px: float
    strength: float


@dataclass(frozen=True)
class Shadow:
    """A half-plane in shadow: points with `x cos a + y sin a > offset_px` keep `light` of theirs; soft by `soft_px`."""

    angle_rad: float
    offset_px: float
    light: float
    soft_px: float


@dataclass(frozen=True)
class Fiducial:
    """A mark fixed to the plate: its centre (mm), its turn, and what it is."""

    x_mm: float
    y_mm: float
    yaw_rad: float = 0.0
    mark: Mark = field(default_factory=lambda: Mark(side_mm=4.0, margin=0.25))


@dataclass(frozen=True)
class Scene:
    """All that does not move with the block.

    `plate`: field of reflectance (see `plates`); `mark_height_mm`: the block's top above the plate; `light`: level of
    white on the sensor (1 = saturation); `clutter` lies on the plate under the block, `occluders` over it (image frame,
    px); `glare` and `shadows` are fixed in the image.
    """

    plate: Plate = field(compare=False)  # an array, which from Python 3.13 on cannot be compared among other fields
    mark: Mark = field(default_factory=Mark)
    ink: Ink = field(default_factory=Ink)
    mark_height_mm: float = 0.0
    fiducials: tuple[Fiducial, ...] = ()
    optics: Optics = field(default_factory=Optics)
    shutter: Shutter = field(default_factory=Shutter)
    sensor: Sensor = field(default_factory=Sensor)
    light: float = 0.9
    clutter: tuple[Layer, ...] = ()
    occluders: tuple[Layer, ...] = ()
    glare: tuple[Glare, ...] = ()
    shadows: tuple[Shadow, ...] = ()


def plate_fiducials(*, place_mm: float = 42.0, side_mm: float = 4.0) -> tuple[Fiducial, ...]:
    """Returns four plain squares with a white margin in the plate's corners, in the order of a mark's corners."""
    mark = Mark(side_mm=side_mm, margin=0.25)
    signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    return tuple(Fiducial(x * place_mm, y * place_mm, mark=mark) for x, y in signs)


def camera_rotation(optics: Optics) -> NDArray[np.float64]:
    """Returns the homography (3, 3), image to image, of the camera's small rotation about its own centre."""
    focal = optics.px_per_mm * optics.height_mm
    cx, cy = optics.centre_px
    intrinsics = np.array([[focal, 0.0, cx], [0.0, focal, cy], [0.0, 0.0, 1.0]])
    ax, ay = optics.tilt_rad
    about_x = np.array([[1, 0, 0], [0, np.cos(ax), -np.sin(ax)], [0, np.sin(ax), np.cos(ax)]])
    about_y = np.array([[np.cos(ay), 0, np.sin(ay)], [0, 1, 0], [-np.sin(ay), 0, np.cos(ay)]])
    return intrinsics @ about_x @ about_y @ np.linalg.inv(intrinsics)

"""The camera of a table of corner pixels, which rides on the plate, from the TOML file beside the table."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from shared.config import Table, load_table, parse
from shared.errors import UserError
from shared.geometry import Array, apply_homography, matrix_from_quaternion, undistort
from shared.messages import CameraGeometry

DOWN = (0.0, 1.0, 0.0, 0.0)
"""plate_from_camera of a camera that looks straight down, with the image's x along the plate's."""


@dataclass(frozen=True, kw_only=True)
class Lens:
    """`[camera]`: pinhole and lens as OpenCV has them; the pinhole in the plate, m, and plate_from_camera, w x y z.

    `sigma_px` is one corner's standard deviation; without it, it is read from the frames.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    width_px: int
    height_px: int
    position_m: tuple[float, float, float]
    quaternion: tuple[float, float, float, float] = DOWN
    distortion: tuple[float, ...] = ()
    sigma_px: float | None = None

    def __post_init__(self) -> None:
        if min(self.fx, self.fy, self.width_px, self.height_px) <= 0:
            raise ValueError("expected positive fx, fy, width_px and height_px")
        if not np.linalg.norm(self.quaternion) > 0:
            raise ValueError("expected a unit quaternion plate_from_camera, got zeros")
        if len(self.distortion) not in (0, 4, 5):
            raise ValueError(
                f"expected k1, k2, p1, p2 and perhaps k3 as distortion, got {len(self.distortion)} numbers"
            )


@dataclass(frozen=True, kw_only=True)
class Mark:
    """`[mark]`: the mark's first side, its second over the first, and its height above the plate."""

    side_m: float
    aspect: float = 1.0
    height_m: float

    def __post_init__(self) -> None:
        if min(self.side_m, self.aspect) <= 0 or self.height_m < 0:
            raise ValueError("expected a positive side_m and aspect, and a height_m of at least 0")


@dataclass(frozen=True, kw_only=True)
class Camera:
    """The file: `[camera]` and `[mark]`."""

    camera: Lens
    mark: Mark
    file: str = ""

    def ideal(self, corners_px: Array) -> Array:
        """Returns `corners_px` (n, 4, 2), px, as the same camera without its lens's distortion would see them."""
        lens = self.camera
        intrinsics = (lens.fx, 0.0, lens.cx, 0.0, lens.fy, lens.cy, 0.0, 0.0, 1.0)
        flat = undistort(corners_px.reshape(-1, 2), intrinsics=intrinsics, distortion=lens.distortion)
        return flat.reshape(corners_px.shape)

    def rig_toml(self) -> str:
        """Returns the tables of a rig file with what is known of camera and mark."""
        lens, mark = self.camera, self.mark
        return (
            f"\n[camera]\nwidth_px = {lens.width_px}\nheight_px = {lens.height_px}\n"
            f"height_mm = {1e3 * lens.position_m[2]:.6g}\n"
            f"\n[mark]\nside_mm = {1e3 * mark.side_m:.6g}\naspect = {mark.aspect:.6g}\n"
        )

    def geometry(self, corners_px: Array) -> CameraGeometry:
        """Returns the geometry that turns ideal pixels into places; the scale is that in the middle of the corners.

        The corners are ideal ones, `corners_px` (n, 4, 2), px, nan where the mark was lost.

        Raises:
            UserError: if the camera is not above the mark, or does not look at it.
        """
        lens, height = self.camera, self.mark.height_m
        x, y, z = lens.position_m
        turn = matrix_from_quaternion(lens.quaternion)
        inverse = np.linalg.inv(np.array([[lens.fx, 0.0, lens.cx], [0.0, lens.fy, lens.cy], [0.0, 0.0, 1.0]]))
        # A ray (camera's frame d, plate's frame turn d) meets the plate at position − z (turn d) / (turn d)_z.
        homography = np.vstack([x * turn[2] - z * turn[0], y * turn[2] - z * turn[1], turn[2]]) @ inverse
        middle = np.nanmedian(corners_px.reshape(-1, 2), axis=0)
        if not (z > height and float((turn @ inverse @ [*middle, 1.0])[2]) < 0.0):
            raise UserError(
                f"Expected in {self.file} a camera above the mark that looks down at it, got one at "
                f"position_m = {list(lens.position_m)} that sees the mark's corners elsewhere; quaternion is "
                "plate_from_camera (w x y z), and the camera's z looks ahead"
            )
        around = apply_homography(homography, middle + np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]))
        area = abs(float(np.linalg.det(around[1:] - around[0])))
        return CameraGeometry(
            plate_from_pixel=tuple((homography / homography[2, 2]).ravel().tolist()),
            mm_per_px=1e3 * area**0.5,
            marker_side_m=self.mark.side_m,
            marker_aspect=self.mark.aspect,
            mark_height_m=height,
            camera_x_m=x,
            camera_y_m=y,
            camera_height_m=z,
            corner_sigma_px=lens.sigma_px or 0.0,
            source=self.file,
        )


def camera_beside(table: Path) -> Camera:
    """Returns the camera in the TOML file of the table's name.

    Raises:
        UserError: if there is none, or it says something impossible.
    """
    path = table.with_suffix(".toml")
    if not path.is_file():
        raise UserError(
            f"Expected the camera of the corners u0 to v3 of {table} in {path}, with the tables [camera] and [mark], "
            "but there is no such file"
        )
    loaded = load_table(path)
    return parse(Camera, Table({**loaded.values, "file": str(path)}, loaded.file, loaded.text))

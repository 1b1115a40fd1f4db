"""The block's mark as the corner pixels of a table show it.

The mark's height is known, so a corner's ray meets the mark's plane in one point, and the pose in that plane is the
least squares fit of the four, as on our rig. A pose in space from four corners would have the error of their distance,
too. The recording keeps the pixels: what the camera itself does to them can only be tested on these.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from shared.errors import UserError
from shared.geometry import Array, block_pose_of, corners_on_plate
from shared.messages import CameraGeometry, MarkerCorners
from station.recording.importers.tracks.camera import Camera, camera_beside
from station.recording.importers.tracks.table import Tracks
from station.recording.importers.tracks.units import CORNERS

STEPS = np.array([1.0, -3.0, 3.0, -1.0])
"""The third difference of even frames shows their noise alone: a slide's jerk moves it by micrometres."""

TO_SIGMA = 1.4826
"""The standard deviation of a Gaussian over its median absolute deviation."""

NOISELESS_PX = 1e-3
"""Less noise than this is a simulation's rounding, and no camera's: the best trackers have 0.01 px."""

WRONG_AREA = 0.2
"""A mark whose area is off by this share has another size, height or camera than was told: 10 % of a side, or of the
camera's distance. Of a right calibration the area is off by some per cent."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Corners:
    """Ideal corners (n, 4, 2), px, nan where the mark was lost, with their noise and the camera's geometry."""

    corner_px: Array
    sigma_px: float
    camera: Camera
    geometry: CameraGeometry

    def message(self, row: int, *, seq: int, stamp_ns: int) -> MarkerCorners:
        """Returns the message of one row."""
        corner_px = self.corner_px[row]
        if not np.isfinite(corner_px).all():
            return MarkerCorners(capture_ns=stamp_ns, seq=seq, reason="no corners in the source")
        return MarkerCorners(
            capture_ns=stamp_ns,
            seq=seq,
            corners_px=tuple(corner_px.ravel().tolist()),
            sigma_px=self.sigma_px,
            corner_dt_ns=(0, 0, 0, 0),
            found=True,
            noiseless=self.sigma_px < NOISELESS_PX,
        )


def with_corners(table: Tracks) -> tuple[Tracks, Corners | None]:
    """Returns the table with the poses that its corners show, and the corners; a table without any as it is.

    Raises:
        UserError: for a table with places, too, or without some corners, and without a camera that saw such a mark.
    """
    there = [name for name in CORNERS if name in table]
    if not there:
        return table, None
    both = [name for name in ("x", "y", "yaw") if name in table]
    if both or len(there) < len(CORNERS):
        missing = ", ".join(name for name in CORNERS if name not in table)
        raise UserError(
            f"Expected the block's place in {table.source} as x_m, y_m and yaw_rad or as all of u0, v0 to u3, v3, "
            + (f"got {', '.join(both)} beside {there[0]}" if both else f"missing are {missing}")
        )
    seen = np.column_stack([table.numbers[name] for name in CORNERS]).reshape(-1, 4, 2)
    corners = _seen(seen, camera_beside(Path(table.source)), table)
    poses = dict(zip(("x", "y", "yaw"), _poses(corners, table), strict=True))
    return replace(table, numbers={**table.numbers, **poses}), corners


def _seen(seen_px: Array, camera: Camera, table: Tracks) -> Corners:
    if not np.isfinite(seen_px).all(axis=(1, 2)).any():
        raise UserError(f"Expected corners u0 to v3 in some row of {table.source}, found none with all of them")
    ideal_px = camera.ideal(seen_px)
    geometry = camera.geometry(ideal_px)
    _refuse_another_mark(ideal_px, geometry, table.source)
    configured_px = camera.camera.sigma_px
    sigma_px = noise_px(ideal_px, table.numbers["run"]) if configured_px is None else configured_px
    return Corners(corner_px=ideal_px, sigma_px=sigma_px, camera=camera, geometry=geometry)


def _poses(corners: Corners, table: Tracks) -> Array:
    """Returns the block's x, y (m) and yaw (rad), unwrapped within each run, (3, n); nan where the mark was lost."""
    found = np.full((len(corners.corner_px), 3), np.nan)
    known = np.isfinite(corners.corner_px).all(axis=(1, 2))
    for row in np.flatnonzero(known).tolist():
        found[row] = block_pose_of(corners.corner_px[row].ravel().tolist(), corners.geometry)
    for run in np.unique(table.numbers["run"]):
        own = known & (table.numbers["run"] == run)
        found[own, 2] = np.unwrap(found[own, 2])
    return found.T


def _refuse_another_mark(ideal_px: Array, geometry: CameraGeometry, source: str) -> None:
    known = ideal_px[np.isfinite(ideal_px).all(axis=(1, 2))]
    first, second, third, fourth = corners_on_plate(known.reshape(-1, 2), geometry).reshape(-1, 4, 2).transpose(1, 0, 2)
    across, along = third - first, fourth - second
    area = float(np.median(0.5 * (across[:, 1] * along[:, 0] - across[:, 0] * along[:, 1])))
    expected = geometry.marker_side_m**2 * geometry.marker_aspect
    if not abs(area - expected) < WRONG_AREA * expected:
        order = "; the corners must run clockwise in the picture" if area < 0 else ""
        raise UserError(
            f"Expected a mark of {1e6 * expected:.4g} mm² in {source}, as {geometry.source} says, but its corners "
            f"enclose {1e6 * area:.4g} mm²; look at side_m, height_m and position_m{order}"
        )


def noise_px(corner_px: Array, run: Array) -> float:
    """Returns one corner's standard deviation, px, by the third differences of consecutive frames of one run.

    Args:
        corner_px: (n, 4, 2) the corners, px; nan where the mark was lost.
        run: (n,) the number of each frame's run.
    """
    count = len(corner_px) - len(STEPS) + 1
    steps = np.sum([weight * corner_px[index : count + index] for index, weight in enumerate(STEPS)], axis=0)
    steps = steps[run[:count] == run[len(STEPS) - 1 :]]
    known = np.abs(steps[np.isfinite(steps)])
    return TO_SIGMA * float(np.median(known)) / float(np.linalg.norm(STEPS)) if len(known) else 0.0

"""The slides of a surface pair as columns: what the filters, tests and figures work on."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from shared.geometry import corners_on_plate
from shared.messages import CameraGeometry, Sample
from station.friction.direction import (
    Array,
    MarkShape,
    angle_of_repose,
    friction_coefficient,
    local_x_axis,
    mark_shape,
    paper_direction,
    slide_direction,
    turn,
    yaw_of,
)
from station.signals.flags import UNRESOLVED

Bools = NDArray[np.bool_]
_LEAST_SLIDE_PX = 1e-6


def counted(number: int) -> str:
    """Returns a number of samples in words: "1 sample", "2 samples"."""
    return f"{number} sample" if number == 1 else f"{number} samples"


@dataclass(frozen=True, eq=False, kw_only=True)
class Slides:
    """One row a run (n,). Angles in radians, pixels as OpenCV's, metres in the plate frame; NaN where it is not known.

    `tilt_rad` is the paper's alpha at the onset, `azimuth_rad` its beta, `theta_rad` the angle of repose along the
    slide, `mu` its tangent. Directions of the slide: `slide_rad` in the plate frame, `object_rad` against the tracked
    block (360°), `plate_rad` against the plate as it was turned in its mount (360°), `paper_rad` as the paper has it
    (180°); `orientation_rad` is the block's own against the plate's. Corners are (n, 4, 2), before and after the slide;
    `pre_m` and `post_m` are those of the block's outline on the plate, which need a calibration. `censored` runs ended
    without a slide: their angles say only that it takes more. `unresolved` onsets could not be fitted. `at_border`
    slides came with the border filter's flag, from an analysis that had a calibration.
    """

    run: NDArray[np.int64]
    direction: NDArray[np.int64]
    censored: Bools
    unresolved: Bools
    at_border: Bools
    tilt_rad: Array
    azimuth_rad: Array
    theta_rad: Array
    mu: Array
    slide_rad: Array
    object_rad: Array
    plate_rad: Array
    paper_rad: Array
    orientation_rad: Array
    pre_px: Array
    post_px: Array
    pre_m: Array
    post_m: Array
    mass_kg: Array
    shape: MarkShape

    def __len__(self) -> int:
        return len(self.run)

    @property
    def distance_px(self) -> Array:
        """The displacement of the corners (n,), px, on average over the four."""
        return np.linalg.norm(self.post_px - self.pre_px, axis=2).mean(axis=1)

    @property
    def circumference_px(self) -> Array:
        """Circumference of the mark before and after the slide (n, 2)."""
        return np.column_stack([_circumference(self.pre_px), _circumference(self.post_px)])

    @property
    def sector(self) -> NDArray[np.int64]:
        """The nearest of the four tilting directions (n,): the direction itself unless the azimuth was free."""
        return np.round(self.azimuth_rad / (math.pi / 2)).astype(np.int64) % 4

    def where(self, chosen: Bools) -> Slides:
        """Returns the rows that are chosen (n,)."""
        return Slides(**{name: getattr(self, name)[chosen] for name in _COLUMNS}, shape=self.shape)


_COLUMNS = tuple(spec.name for spec in fields(Slides) if spec.name != "shape")


def _circumference(corners: Array) -> Array:
    return np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).sum(axis=1)


def slides_of(samples: Sequence[Sample], geometry: CameraGeometry | None = None) -> Slides:
    """Returns the columns of one session's samples.

    Without a calibration the camera is taken to look straight down with its x along the plate's: directions and angles
    then are still there, places on the plate are not. A sample without corners has no sliding direction; its theta is
    the inclination, as if the block had slid straight down.
    """
    pre_px, post_px = _corners(samples, "reference_corners_px"), _corners(samples, "post_corners_px")
    pre, post = _on_plate(pre_px, geometry), _on_plate(post_px, geometry)
    yaw, slide, shape = yaw_of(pre), slide_direction(pre, post), mark_shape(pre)
    slide[~(np.linalg.norm((post - pre).mean(axis=1), axis=1) > _LEAST_SLIDE_PX)] = np.nan
    tilt, azimuth = _column(samples, lambda s: s.onset_angle_rad), _column(samples, lambda s: s.azimuth_rad)
    mount = _column(samples, lambda s: s.plate_mount_rad)
    along = np.where(np.isnan(slide), azimuth - math.pi / 2, slide)
    theta = angle_of_repose(along, tilt_rad=tilt, azimuth_rad=azimuth) if len(samples) else np.empty(0)
    return Slides(
        run=np.array([s.run for s in samples], dtype=np.int64),
        direction=np.array([s.direction for s in samples], dtype=np.int64),
        censored=np.array([s.censored for s in samples], dtype=bool),
        unresolved=np.array([UNRESOLVED in s.flags for s in samples], dtype=bool),
        at_border=np.array(["border" in s.flags for s in samples], dtype=bool),
        tilt_rad=tilt,
        azimuth_rad=azimuth,
        theta_rad=theta,
        mu=friction_coefficient(theta),
        slide_rad=slide,
        object_rad=turn(slide - yaw),
        plate_rad=turn(slide - mount),
        paper_rad=paper_direction(slide, x_axis_rad=local_x_axis(yaw, short_is_y=shape.short_is_y)),
        orientation_rad=turn(yaw - mount),
        pre_px=pre_px,
        post_px=post_px,
        pre_m=_outline(pre, samples, geometry),
        post_m=_outline(post, samples, geometry),
        mass_kg=_column(samples, lambda s: s.block_mass_kg),
        shape=shape,
    )


def _column(samples: Sequence[Sample], pick: Callable[[Sample], float]) -> Array:
    return np.array([pick(sample) for sample in samples], dtype=float)


def _corners(samples: Sequence[Sample], name: str) -> Array:
    rows = [getattr(sample, name) for sample in samples]
    known = [row if len(row) == 8 else (math.nan,) * 8 for row in rows]
    return np.array(known, dtype=float).reshape(-1, 4, 2)


def _on_plate(corners_px: Array, geometry: CameraGeometry | None) -> Array:
    """Returns corners in a frame with the plate's axes: metres with a calibration, pixels without."""
    if geometry is None:
        return corners_px * np.array([1.0, -1.0])
    return corners_on_plate(corners_px.reshape(-1, 2), geometry).reshape(-1, 4, 2)


def _outline(corners_m: Array, samples: Sequence[Sample], geometry: CameraGeometry | None) -> Array:
    """Returns the block's own corners: those of its mark, moved outwards where the block is known to be larger."""
    if geometry is None or geometry.marker_side_m <= 0:
        return np.full_like(corners_m, np.nan)
    side = np.sqrt(_column(samples, lambda s: s.block_area_m2))
    larger = np.maximum(side / geometry.marker_side_m, 1.0)[:, None, None]
    centre = corners_m.mean(axis=1, keepdims=True)
    return centre + (corners_m - centre) * larger


def joined(parts: Sequence[Slides]) -> Slides:
    """Returns several sessions of one pair as one.

    Raises:
        ValueError: for no session at all.
    """
    if not parts:
        raise ValueError("expected at least one session")
    columns = {name: np.concatenate([getattr(part, name) for part in parts]) for name in _COLUMNS}
    return Slides(**columns, shape=max(parts, key=len).shape)

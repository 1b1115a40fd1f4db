"""Synthetic tables of samples: a block that slides straight down on a plate, with friction that is planted."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from shared.geometry import mark_corners, pixels_of_mark
from shared.messages import CameraGeometry, Sample

GEOMETRY = CameraGeometry(
    plate_from_pixel=(1 / 6000, 0, -299.5 / 6000, 0, -1 / 6000, 299.5 / 6000, 0, 0, 1),
    mm_per_px=1 / 6,
    marker_side_m=0.01,
    marker_aspect=1.0,
)


def corners_px(x_m: float, y_m: float, yaw_rad: float, *, aspect: float = 1.0) -> tuple[float, ...]:
    """The eight numbers that the camera would report."""
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    model = mark_corners(side_m=0.01, aspect=aspect) @ np.array([[c, s], [-s, c]]) + np.array([x_m, y_m])
    return tuple(float(value) for value in pixels_of_mark(model, GEOMETRY).ravel())


def sample(
    *,
    run: int = 1,
    angle_rad: float = 0.35,
    azimuth_rad: float = 0.0,
    start_m: tuple[float, float] = (0.0, 0.0),
    slide_m: float = 0.015,
    slide_rad: float | None = None,
    yaw_rad: float = 0.0,
    aspect: float = 1.0,
) -> Sample:
    """One run; the block slides straight down unless `slide_rad` says otherwise."""
    towards = azimuth_rad - math.pi / 2 if slide_rad is None else slide_rad
    end = (start_m[0] + slide_m * math.cos(towards), start_m[1] + slide_m * math.sin(towards))
    return Sample(
        run=run,
        start_ns=run * 22_000_000_000,
        reference_corners_px=corners_px(*start_m, yaw_rad, aspect=aspect),
        post_corners_px=corners_px(*end, yaw_rad, aspect=aspect),
        direction=round(azimuth_rad / (math.pi / 2)) % 4,
        azimuth_rad=azimuth_rad,
        onset_angle_rad=angle_rad,
        object="cube",
        plate="wood",
        block_mass_kg=0.008,
        block_area_m2=1e-4,
    )


def session(
    count: int,
    *,
    rng: np.random.Generator,
    mu: Callable[[float], float] = lambda _: 0.36,
    scatter: float = 0.1,
    aspect: float = 1.0,
    turning: bool = True,
) -> list[Sample]:
    """Samples whose mu is `mu(direction against the object)` times a lognormal scatter, in four tilting directions.

    With `turning` the block lies at any yaw; without it at none.
    """
    found: list[Sample] = []
    for run in range(1, count + 1):
        azimuth = float(rng.integers(4)) * math.pi / 2
        yaw = float(rng.uniform(-math.pi, math.pi)) if turning else 0.0
        planted = mu((azimuth - math.pi / 2 - yaw) % (2 * math.pi)) * math.exp(scatter * rng.standard_normal())
        place = rng.uniform(-0.015, 0.015, 2)
        made = sample(
            run=run,
            angle_rad=math.atan(planted),
            azimuth_rad=azimuth,
            start_m=(float(place[0]), float(place[1])),
            slide_m=float(rng.uniform(0.006, 0.018)),
            yaw_rad=yaw,
            aspect=aspect,
        )
        found.append(_noisy(made, rng))
    return found


def _noisy(made: Sample, rng: np.random.Generator) -> Sample:
    before, after = (
        tuple(float(value) for value in np.array(corners) + rng.normal(0, 0.05, 8))
        for corners in (made.reference_corners_px, made.post_corners_px)
    )
    return replace(made, reference_corners_px=before, post_corners_px=after)

"""Projects the mark's frame to pixels: pose, perspective, camera rotation, radial distortion, rolling shutter."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pi_agent.rendering.marks import Layer
from pi_agent.rendering.scene import Optics, Pose, Scene, camera_rotation

Floats = NDArray[np.float64]

EDGE_CUTS = 8  # pieces of an edge when the lens bends it


@dataclass(frozen=True)
class Edges:
    """The directed edges of all layers: ends (edges, 2) in one frame, and the layer of each (edges,)."""

    starts: Floats
    ends: Floats
    layer: NDArray[np.int64]
    reflectances: tuple[float, ...]


def collect_edges(layers: tuple[Layer, ...], *, cuts: int = 1) -> Edges:
    """Returns all edges of the layers' polygons, each cut into `cuts` equal pieces."""
    starts, ends, numbers = [np.zeros((0, 2))], [np.zeros((0, 2))], [np.zeros(0, dtype=np.int64)]
    share = np.arange(cuts)[:, None] / cuts
    for number, layer in enumerate(layers):
        for polygon in layer.polygons:
            step = np.roll(polygon, -1, axis=0) - polygon
            start = (polygon[:, None] + share * step[:, None]).reshape(-1, 2)
            starts.append(start)
            ends.append(np.roll(start, -1, axis=0))
            numbers.append(np.full(len(start), number, dtype=np.int64))
    reflectances = tuple(layer.reflectance for layer in layers)
    return Edges(np.concatenate(starts), np.concatenate(ends), np.concatenate(numbers), reflectances)


def project(points_mm: Floats, pose: Pose, *, optics: Optics, height_mm: float, dt_s: ArrayLike = 0.0) -> Floats:
    """Returns pixels (times, n, 2) of `points_mm` (n, 2), mm in the mark's frame, at each time after the capture."""
    dt = np.clip(np.atleast_1d(np.asarray(dt_s, dtype=np.float64))[:, None], *pose.moves_s)
    gain_x, gain_y, gain_yaw = (0.5 * gain * dt * dt for gain in pose.gain)
    yaw = pose.yaw_rad + pose.yaw_rate_rad_s * dt + gain_yaw
    cos, sin = np.cos(yaw), np.sin(yaw)
    x, y = points_mm[:, 0], points_mm[:, 1]
    across_x, across_y, up = _tip(cos * x - sin * y, sin * x + cos * y, pose)
    depth = 1.0 - (height_mm + up) / optics.height_mm
    scale = optics.px_per_mm / depth
    u = scale * (pose.x_mm + pose.vx_mm_s * dt + gain_x + across_x)
    v = scale * (pose.y_mm + pose.vy_mm_s * dt + gain_y + across_y)
    return _through_the_lens(np.stack([u, v], axis=-1), optics)


def corners_px(scene: Scene, pose: Pose, *, sag_px: tuple[float, float] = (0.0, 0.0)) -> Floats:
    """Returns the true corners (4, 2) as seen: each at the time at which its own row was exposed."""
    points = scene.mark.corners_mm()
    rows = np.zeros(4)
    seen = np.zeros((4, 2))
    rolling = scene.shutter.line_ns != 0 and not pose.is_still
    for _ in range(8 if rolling else 1):  # the error shrinks to line time × speed of itself a turn, some 3 %
        times = scene.shutter.dt_s(rows)
        views = project(points, pose, optics=scene.optics, height_mm=scene.mark_height_mm, dt_s=times)
        seen = views[np.arange(4), np.arange(4)] + np.asarray(sag_px)
        rows = seen[:, 1]
    return seen


def _tip(x: Floats, y: Floats, pose: Pose) -> tuple[Floats, Floats, Floats]:
    """Turns points about the horizontal axis through the mark's centre; returns x, y and the height gained."""
    if pose.tip_rad == 0:
        return x, y, np.zeros_like(x)
    along = np.array([np.cos(pose.tip_axis_rad), np.sin(pose.tip_axis_rad)])
    away = along[0] * y - along[1] * x
    loss = away * (np.cos(pose.tip_rad) - 1.0)
    return x - along[1] * loss, y + along[0] * loss, away * np.sin(pose.tip_rad)


def _through_the_lens(offset: Floats, optics: Optics) -> Floats:
    if optics.tilt_rad != (0.0, 0.0):
        turn = camera_rotation(optics)
        placed = offset + np.asarray(optics.centre_px)
        homogeneous = placed @ turn[:, :2].T + turn[:, 2]
        offset = homogeneous[..., :2] / homogeneous[..., 2:] - np.asarray(optics.centre_px)
    if optics.radial != 0:
        offset = offset * (1.0 + optics.radial * np.sum(offset**2, axis=-1, keepdims=True) / 300.0**2)
    return offset + np.asarray(optics.centre_px)

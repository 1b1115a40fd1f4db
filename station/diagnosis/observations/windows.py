"""Short windows of a slide: the acceleration in its weak form, and the states at a few nodes to compare it with.

The curvature of a parabola that is fitted to nine places is the mean of the acceleration over the window, with a weight
that the nine times determine: no noisy path is differentiated. The prediction is averaged with the same weight, by
Gauss's rule at three nodes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from station.diagnosis import thresholds
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.tracks import RunTrack
from station.physics.contact import Array

FRAMES = 9
LEAST_FRAMES = 7
UNEVEN = 1.2
"""The factor on the largest gap between frames that their jitter explains."""

MARGIN_NS = 30_000_000
FINE_NODES: Array = np.linspace(-1.0, 1.0, 41)
"""The nodes for the pull while the plate is set in motion or stopped, which has corners."""


def weight_of(times: Array) -> Array:
    """Returns the weight at FINE_NODES (41,), with sum 1, of a parabola's fit to places at `times` (k,), from −1 to 1.

    It follows from two integrations by parts: the fit's curvature is a sum of places, and each place is the double
    integral of the acceleration.
    """
    curvature = np.linalg.pinv(np.column_stack([np.ones_like(times), times, times**2]))[2]
    weight = curvature @ np.maximum(times[:, None] - FINE_NODES, 0.0)
    return weight / weight.sum()


def _gauss(weight: Array) -> tuple[Array, Array]:
    """Gives three nodes and weights that average polynomials up to the fifth degree as the even `weight` (41,) does."""
    second, fourth = (float(weight @ FINE_NODES**power) for power in (2, 4))
    far, share = math.sqrt(fourth / second), 0.5 * second**2 / fourth
    return np.array([-far, 0.0, far]), np.array([share, 1.0 - 2.0 * share, share])


NODES, WEIGHTS = _gauss(weight_of(np.linspace(-1.0, 1.0, FRAMES)))


WINDOW = np.dtype(
    [
        ("run", np.int64), ("from_ns", np.int64), ("to_ns", np.int64), ("node_ns", np.int64, 3),
        ("node_pose", np.float64, (3, 3)), ("node_velocity", np.float64, (3, 2)),
        ("node_yaw_rate_rad_s", np.float64, 3), ("node_way_rad", np.float64, 3), ("way_sigma_rad", np.float64),
        ("acceleration_m_s2", np.float64, 2), ("yaw_acceleration_rad_s2", np.float64),
        ("acceleration_factor", np.float64), ("velocity_factor", np.float64),
        ("weight", np.float64, len(FINE_NODES)), ("frame_ns", np.int64, FRAMES),
        ("curvature", np.float64, FRAMES), ("free_m", np.float64),
    ]
)  # fmt: skip
"""A window: its run's index in the evidence, its times, the states at the nodes, and the accelerations.

`way_sigma_rad` is the standard error of the direction at the middle, by the whole path. The factors are the standard
deviations of the acceleration over that of a place, 1/s², and of the velocity, 1/s. `weight` is that of the
acceleration at FINE_NODES, `curvature`, 1/s², that of the places at the frames, of which the sum is the acceleration,
and `free_m` the least distance of the block from the foam."""

Windows = NDArray[Any]
"""Windows (n,) with the fields of WINDOW."""


def windows_of(tracks: Sequence[RunTrack], setting: Setting) -> Windows:
    """Gives the windows (n,) of all slides, run by run in their order; a run is given by its index among the tracks."""
    rows = [(run, *window) for run, track in enumerate(tracks) for window in _of_track(track, setting)]
    return np.array(rows, dtype=WINDOW)


def _of_track(track: RunTrack, setting: Setting) -> Iterator[tuple[Any, ...]]:
    """Yields the windows of a slide, side by side, from MARGIN_NS after the onset to MARGIN_NS before the stop.

    A window with a moment of rest would show too little acceleration. Windows in which the block hardly moves are left
    out. They are laid from the stop back: counted from the onset as read, its error would decide which windows a slide
    has, and an onset that is read late would keep a faster one.
    """
    if not track.slid:
        return
    part = track.frames(max(track.slip_ns, track.surely_ns) + MARGIN_NS, track.stop_ns - MARGIN_NS)
    course = Course.of(track.pose[part, :2], sigma_m=track.sigma_m)
    if course is None:
        return
    # The yaw is a straight line in time: a window's curvature is independent of a straight line's noise.
    turning = np.polyfit((track.time_ns[part] - track.slip_ns) * 1e-9, track.pose[part, 2], 1)
    for first in range(part.start + (part.stop - part.start) % FRAMES, part.stop - FRAMES + 1, FRAMES):
        frames = slice(first, first + FRAMES)
        window = _window(track, frames, course, turning)
        if window is not None:
            yield *window, setting.free_m(track.pose[frames]).min()


@dataclass(frozen=True, eq=False, kw_only=True)
class Course:
    """The direction of a slide as a smooth function of the distance along it, from the whole path.

    The direction of one window's own velocity would be noisy, and its noise would enter the sideways force: a law that
    turns the force with the direction would then seem to explain noise.
    """

    middle: Array
    main: Array
    fit: Array
    inverse: Array
    scale_m: float
    sigma_m: float

    @classmethod
    def of(cls, place_m: Array, *, sigma_m: float) -> Course | None:
        """Returns the course of a path `place_m` (n, 2), m in P; None if it is too short."""
        if len(place_m) < FRAMES:
            return None
        middle, main = place_m.mean(axis=0), place_m[-1] - place_m[0]
        length = float(np.linalg.norm(main))
        if length < thresholds.SHORTEST_M:
            return None
        main = main / length
        along, aside = _along_aside(place_m - middle, main)
        degree = 1 if length < 5 * thresholds.SHORTEST_M or len(place_m) < 3 * FRAMES else 3
        basis = np.column_stack([(along / length) ** k for k in range(degree + 1)])
        inverse = np.linalg.pinv(basis)
        fit = inverse @ aside
        left = float(np.sqrt(np.mean((aside - basis @ fit) ** 2)))
        # A path that no such curve fits (a block that was knocked) has no usable direction.
        sigma_m = sigma_m if left < thresholds.CROOKED * sigma_m else 10 * left
        return cls(middle=middle, main=main, fit=fit, inverse=inverse @ inverse.T, scale_m=length, sigma_m=sigma_m)

    def at(self, place_m: Array) -> tuple[Array, Array]:
        """Gives the direction (m,), rad in P, at `place_m` (m, 2), m, near a path, and its standard error (m,), rad."""
        along, _ = _along_aside(place_m - self.middle, self.main)
        share = along / self.scale_m
        order = np.arange(len(self.fit))
        slopes = np.where(order > 0, order * share[:, None] ** np.maximum(order - 1, 0), 0.0) / self.scale_m
        way = np.arctan2(self.main[1], self.main[0]) + np.arctan(slopes @ self.fit)
        return way, self.sigma_m * np.sqrt(np.einsum("ij,jk,ik->i", slopes, self.inverse, slopes))


def _along_aside(offset: Array, main: Array) -> tuple[Array, Array]:
    return offset @ main, offset @ np.array([-main[1], main[0]])


def _window(track: RunTrack, frames: slice, course: Course, turning: Array) -> tuple[Any, ...] | None:
    times, pose = track.time_ns[frames], track.pose[frames]
    middle = (int(times[0]) + int(times[-1])) // 2
    half_s = 0.5e-9 * float(times[-1] - times[0])
    s: Array = np.asarray((times - middle) * 1e-9 / half_s, dtype=np.float64)
    gap = float(np.max(np.diff(s)))
    if gap > 2.0 * (FRAMES - LEAST_FRAMES + 1) / (FRAMES - 1) * UNEVEN:
        return None
    basis = np.column_stack([np.ones_like(s), s, s * s])
    inverse = np.linalg.pinv(basis)
    fit = inverse @ pose
    node = np.column_stack([np.ones_like(NODES), NODES, NODES**2]) @ fit
    velocity = np.column_stack([np.zeros_like(NODES), np.ones_like(NODES), 2 * NODES]) @ fit / half_s
    velocity_factor = float(np.linalg.norm(inverse[1])) / half_s
    # The speed at the middle is independent of the curvature's noise: choosing windows by the speed at their ends would
    # choose accelerations.
    if float(np.hypot(velocity[1, 0], velocity[1, 1])) < max(
        thresholds.SLOWEST_M_S, thresholds.SLOWEST_SIGMAS * velocity_factor * track.sigma_m
    ):
        return None
    way, way_sigma = course.at(node[:, :2])
    node[:, 2] = np.polyval(turning, (middle - track.slip_ns) * 1e-9 + NODES * half_s)
    times_ns = (times[0], times[-1], (middle + np.round(NODES * half_s * 1e9)).astype(np.int64))
    states = (node, velocity[:, :2], velocity[:, 2], way, way_sigma[1])
    curvature = 2 * inverse[2] / half_s**2
    acceleration = curvature @ pose
    factor = np.linalg.norm(curvature)
    weights = (weight_of(s), times, curvature)
    return *times_ns, *states, acceleration[:2], acceleration[2], factor, velocity_factor, *weights

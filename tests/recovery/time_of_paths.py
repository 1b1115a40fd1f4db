"""The time between a recorded path of the block and the recorded attitude of the plate that moved it.

While a block slides on one friction coefficient mu, Newton's second law in the plate's frame is

    p'' = f - mu n v / |v|,    n = minus the sum's part across the plate,
    f = the part along the plate of (g - omega x (omega x r) - 2 omega x v)(t + lead) - (A + alpha x r)(t + push_lead)

with A the acceleration of the pivot and r the place of the block's mass from the pivot. A path that is right has leads
of 0; one that comes before its attitude, or before the plate's acceleration, has a positive one. Both sides are
integrated twice, so that recorded places are compared with predicted ones and nothing of the noisy path is
differentiated. Free in each slide are its first place and velocity (2 + 2) and its friction along and across the motion
(2); common to a session are the leads, and the share of A that the recorded world applies (1, or 0 in a simulator whose
pivot does not move).

Nothing here is shared with station/diagnosis, with the simulators or with the generators.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray
from scipy.integrate import cumulative_simpson
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from station.signals.session import Signals

Array = NDArray[np.float64]
GRAVITY_M_S2 = 9.81
GRID_S = 5e-4
MOVED_M, SLOWEST_M_S, LEAST_FRAMES = 1e-3, 0.02, 12
"""A slide is looked at from 1 mm on, while the speed over five frames is above 20 mm/s, if it has so many frames."""
ROUNDS, STEP_S, DEGREE = 4, 1e-4, 7
LEAST_NOISE_M = 1e-7
LEAST_M_S2 = 1e-4
"""Least size of the pivot's acceleration, against the 1 m/s^3 or so by which a lead is told, to know its share."""
LEAST_OF_PULL = 1e-2
"""Least change of the plate's acceleration with time, as a share of the pull's, to know how late the block feels it."""


@dataclass(frozen=True, kw_only=True)
class Lead:
    """The lead (s) of a session's paths before their attitude and the plate's acceleration, each with its sd.

    `pivot_share` is the part of the pivot's acceleration that the paths show. What a session cannot know has an
    infinite sd.

    `rms_m` is the median over the slides of the root mean square residual of their places.
    """

    lead_s: float
    lead_sd_s: float
    pivot_share: float
    pivot_share_sd: float
    push_lead_s: float
    push_lead_sd_s: float
    rms_m: float
    slides: int


@dataclass(frozen=True, eq=False)
class _Slide:
    time_s: Array
    place_m: Array


def lead_of(signals: Signals, *, reach_m: float, above_pivot_m: float = 0.0) -> Lead:
    """Estimates the lead of all slides of a session together, by least squares, each slide with a noise of its own.

    The noise of a slide holds what 100 readings a second do not show of a plate that is stopped suddenly.

    Args:
        signals: corners with a calibration, and the plate's attitude with its pivot.
        reach_m: the block's centre is free of walls and foam within this distance from the plate's centre.
        above_pivot_m: height of the block's mass above the pivot.

    Raises:
        ValueError: if no slide is long enough.
    """
    plate = _Plate(signals)
    slides = list(_slides(signals, plate.origin_ns, reach_m=reach_m))
    if not slides:
        raise ValueError(f"expected slides of {LEAST_FRAMES} frames and more, found none")
    courses = [_course(slide) for slide in slides]
    found, sds, noise = np.zeros(3), np.full(3, np.inf), np.ones(len(slides))
    for _ in range(ROUNDS):
        normal, right = np.zeros((3, 3)), np.zeros(3)
        rest: list[tuple[Array, Array]] = []
        for slide, course, sd in zip(slides, courses, noise, strict=True):
            own, common, left = _linearised(slide, plate, course, found, above_pivot_m=above_pivot_m)
            basis, _ = np.linalg.qr(own)
            common, left = common - basis @ (basis.T @ common), left - basis @ (basis.T @ left)
            normal += common.T @ common / sd**2
            right += common.T @ left / sd**2
            rest.append((common, left))
        # A session whose pivot stands still knows nothing of the share.
        known = np.diag(normal) > normal[0, 0] * np.array([0.0, LEAST_M_S2, LEAST_OF_PULL]) ** 2
        step, sds = np.zeros(3), np.full(3, np.inf)
        step[known] = np.linalg.solve(normal[np.ix_(known, known)], right[known])
        sds[known] = np.sqrt(np.diag(np.linalg.inv(normal[np.ix_(known, known)])))
        found = found + step
        noise = np.array([_rms(left - common @ step) for common, left in rest])
    return Lead(
        lead_s=float(found[0]),
        lead_sd_s=float(sds[0]),
        pivot_share=float(found[1]),
        pivot_share_sd=float(sds[1]),
        push_lead_s=float(found[2]),
        push_lead_sd_s=float(sds[2]),
        rms_m=float(np.median(noise)),
        slides=len(slides),
    )


def _rms(left: Array) -> float:
    """A slide's own noise (m), with its six numbers taken off, and what numerics leave at least."""
    return float(np.sqrt(left @ left / (len(left) - 6) + LEAST_NOISE_M**2))


class _Plate:
    """Gravity, turning and the pivot's acceleration in the plate's frame, from cubics through the readings."""

    def __init__(self, signals: Signals) -> None:
        attitude = signals.attitude
        rises = np.diff(attitude.time_ns, prepend=attitude.time_ns[:1] - 1) > 0
        known = attitude.select(rises & np.isfinite(attitude.quaternion).all(axis=1))
        self.origin_ns = int(known.time_ns[0])
        time_s = np.asarray((known.time_ns - self.origin_ns) * 1e-9, dtype=np.float64)
        turn = Rotation.from_quat(known.quaternion, scalar_first=True).as_matrix()
        self._turn = CubicSpline(time_s, turn.reshape(-1, 9))
        still = not np.isfinite(known.pivot_m).all()
        self._pivot = CubicSpline(time_s, np.zeros_like(known.pivot_m) if still else known.pivot_m)

    def at(self, time_s: Array) -> tuple[Array, Array, Array, Array]:
        """Gravity, rate and angular acceleration, and the pivot's acceleration; each (n, 3)."""
        turn, first, second = (self._turn(time_s, order).reshape(-1, 3, 3) for order in range(3))
        back = turn.transpose(0, 2, 1)
        spin, spun = back @ first, back @ second
        # R' = R W gives R'' = R (W' + W W), and W' is the antisymmetric part.
        rate = _vector(spin)
        return -GRAVITY_M_S2 * turn[:, 2], rate, _vector(spun), np.einsum("nij,nj->ni", back, self._pivot(time_s, 2))


def _vector(matrices: Array) -> Array:
    """The axial vectors (n, 3) of matrices (n, 3, 3)."""
    odd = 0.5 * (matrices - matrices.transpose(0, 2, 1))
    return np.column_stack([odd[:, 2, 1], odd[:, 0, 2], odd[:, 1, 0]])


def _slides(signals: Signals, origin_ns: int, *, reach_m: float) -> Iterator[_Slide]:
    """The stretch of each run in which the block slides freely."""
    geometry = signals.geometry
    if geometry is None:
        raise ValueError("expected a recording with the camera's calibration")
    for run in signals.runs:
        corners = signals.run(run).corners.seen()
        if len(corners) < LEAST_FRAMES:
            continue
        place = corners.pose(geometry)[:, :2]
        time_s = (corners.time_ns - origin_ns) * 1e-9 + corners.corner_dt_ns.mean(axis=1) * 1e-9
        speed = np.zeros(len(place))
        speed[2:-2] = np.hypot(*(place[4:] - place[:-4]).T) / (time_s[4:] - time_s[:-4])
        moved = np.hypot(*(place - place[:5].mean(axis=0)).T) > MOVED_M
        # A hand that lays the block down anew moves it farther than any slide between two frames.
        good = moved & (speed > SLOWEST_M_S) & (speed < 1.0) & (np.hypot(*place.T) < reach_m)
        edges = np.flatnonzero(np.diff(np.concatenate([[False], good, [False]]).astype(int)))
        for first, last in zip(edges[::2], edges[1::2], strict=True):
            if last - first >= LEAST_FRAMES:
                yield _Slide(np.asarray(time_s[first:last]), place[first:last])


@dataclass(frozen=True, eq=False)
class _Course:
    """A slide's place and velocity (m, 2) on a fine grid of time, from a polynomial through its places.

    They serve for the motion's direction and for the small inertial terms only.
    """

    grid_s: Array
    place: Array
    velocity: Array


def _course(slide: _Slide) -> _Course:
    grid = np.arange(slide.time_s[0], slide.time_s[-1] + GRID_S, GRID_S)
    fits = [Polynomial.fit(slide.time_s, slide.place_m[:, axis], DEGREE) for axis in range(2)]
    place = np.column_stack([fit(grid) for fit in fits])
    return _Course(grid, place, np.column_stack([fit.deriv()(grid) for fit in fits]))


def _linearised(
    slide: _Slide, plate: _Plate, course: _Course, common: Array, *, above_pivot_m: float
) -> tuple[Array, Array, Array]:
    """Derivatives of the places by a slide's own numbers (2 n, 6), by the common ones (2 n, 3), and what is left."""
    lead_s, share, push_lead_s = common.tolist()
    grid, since = course.grid_s, slide.time_s - course.grid_s[0]
    way = course.velocity / np.maximum(np.hypot(*course.velocity.T), 1e-4)[:, None]
    aside = np.column_stack([-way[:, 1], way[:, 0]])
    here = np.column_stack([course.place, np.full(len(grid), above_pivot_m)])
    velocity = np.column_stack([course.velocity, np.zeros(len(grid))])

    def pulled(lead: float = lead_s, part: float = share, push_lead: float = push_lead_s) -> Array:
        gravity, rate, _, _ = plate.at(grid + lead)
        _, _, turning, pivot = plate.at(grid + push_lead)
        swung = np.cross(rate, np.cross(rate, here)) + 2.0 * np.cross(rate, velocity)
        return gravity - swung - part * pivot - np.cross(turning, here)

    def integrated(pull: Array) -> Array:
        """Returns what unit causes do to the places (2 n, 3): the pull along the plate, and friction both ways."""
        normal = -pull[:, 2:]
        causes = (pull[:, :2], -normal * way, -normal * aside)
        return np.column_stack([_twice(cause, grid, since).ravel() for cause in causes])

    now, later = integrated(pulled()), integrated(pulled(lead=lead_s + STEP_S))
    fuller, pushed = integrated(pulled(part=share + 1.0)), integrated(pulled(push_lead=push_lead_s + STEP_S))
    own = np.zeros((2 * len(since), 6))
    for axis in range(2):
        own[axis::2, axis], own[axis::2, 2 + axis] = 1.0, since
    own[:, 4:] = now[:, 1:]
    left = slide.place_m.ravel() - now[:, 0]
    friction = np.concatenate([[1.0], np.linalg.lstsq(own, left, rcond=None)[0][4:]])
    changes = ((later - now) / STEP_S, fuller - now, (pushed - now) / STEP_S)
    return own, np.column_stack([change @ friction for change in changes]), left


def _once(values: Array, grid: Array) -> Array:
    """The integral over time since the grid's first moment."""
    return np.asarray(cumulative_simpson(values, x=grid, axis=0, initial=0.0))


def _twice(values: Array, grid: Array, since: Array) -> Array:
    """The integral of the integral, at moments since the grid's first."""
    return np.asarray(CubicSpline(grid - grid[0], _once(_once(values, grid), grid))(since))
